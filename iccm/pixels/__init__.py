"""Pictures: where pixels come from, how texels are filtered, what is written where nothing is covered."""
