"""The running graph or a recording, looked at while time goes on: pages, Foxglove, terminal."""
