"""Do many tasks in the processes of a Dask cluster: on this machine, or on others through TLS.

Whoever names no cluster imports none of the libraries, and opens no socket.
"""
