"""The one place that creates GL objects: context, checked creation with an owner, programs, timers."""
