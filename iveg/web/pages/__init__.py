"""HTML pages: routes, template contexts, translations, charts."""
