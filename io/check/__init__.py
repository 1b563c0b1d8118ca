"""Results against baselines."""
