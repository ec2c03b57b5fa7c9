"""Search for the settings of controllers and learners."""
