"""Do many tasks in the processes of a Dask cluster: on this machine, or on others through TLS.

Without a cluster, none of its libraries are imported, and no socket is opened.
"""
