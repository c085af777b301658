"""Who may do what: authentication, sessions, roles, CSRF, headers, rate limits."""
