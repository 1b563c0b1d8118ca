"""The test suite as on Windows, as far as another system can imitate it."""
