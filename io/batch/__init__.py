"""Many jobs: manifests, pools of workers, and a journal from which to resume.

manifest  jobs in TOML or JSON Lines, checked completely before the first runs
starter   the manifest that `iccm init` writes
names     file names that are valid on every system
globs     the files that patterns match, within limits and inside the root
dispatch  tasks run on a pool, one result for each
pools     processes of this machine, or a Dask cluster
worker    the code that runs in a worker
commands  the commands that a batch can run
journal   the jobs that were begun and finished
overview  an HTML page with the results
digest    what the notes of all jobs of a batch have in common, for its summary
"""
