"""The test suite as on Windows or macOS, as far as another system can imitate them."""
