"""One pydantic model a resource: REST, ``/live``, history, exports, types of the page.

A field is written once, here, with its unit.  OpenAPI and ``static/js/types.d.ts`` come
from these models (``python -m iveg.models.typescript``); beside each model stands how
it is made of what the domain knows and of what the history remembers.
"""
