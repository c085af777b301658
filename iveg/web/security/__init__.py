"""Access control: authentication, sessions, roles, CSRF, headers, rate limits."""
