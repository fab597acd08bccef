"""Contain every command line of the program: one module per command, whose function `main` declares and runs it.

`cli` lists the commands of `depthwalk`. `ablation`, `bench_table` and `soak` are developers' tools, run as
`python -m depthwalk.commands.NAME`. `program` gives all of them the same exit codes and error messages, `options` the
same options; `progress`, `output`, `reports` and `subjects` are shared by several commands.
"""
