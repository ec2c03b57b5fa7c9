"""What survives kills, interruptions, full disks and damaged files; docs/promises.md says it in words."""
