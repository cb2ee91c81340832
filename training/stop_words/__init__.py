"""Make the embedded stop word spotter: speak, mix with rooms and noise, train, export, judge."""
