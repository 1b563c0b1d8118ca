"""Many jobs: manifests, pools of workers, a journal to resume from."""
