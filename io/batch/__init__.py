"""Many jobs: manifests, pools of workers, a journal to resume from.

manifest  jobs in TOML or JSON Lines, checked whole
starter   the manifest that `iccm init` writes
names     file names that every system takes
globs     the files that globs match, inside the root and bounded
dispatch  tasks run on a pool, one result for each
pools     processes of this machine, or a Dask cluster
worker    what runs in a worker
commands  the commands that a batch runs
journal   what was begun and finished, to resume from
overview  the results on one page of HTML
"""
