"""The WebSocket to browsers: sessions, pacing, telemetry frames."""
