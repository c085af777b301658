"""One pydantic model a resource: REST, ``/live``, history, exports, types of the page.

A key is written once, here, with its unit; ``members_of`` names those whose type is the
domain's.  OpenAPI and ``static/js/types.d.ts`` come from these models (``python -m
iveg.models.typescript``); beside each model stands how it is made of what the domain
knows and of what the history remembers.
"""
