"""What all tests share."""

import os

import pytest
from hypothesis import settings
from playwright.sync_api import expect

# A helper's failed assertion shows its values as a test's own does.
pytest.register_assert_rewrite("tests.processes")

# A busy machine may be slow without being wrong; the suite has its own time limits.
settings.register_profile("iveg", deadline=None, max_examples=100)
settings.register_profile("thorough", deadline=None, max_examples=2000)
expect.set_options(timeout=20_000)
settings.load_profile(os.environ.get("IVEG_HYPOTHESIS", "iveg"))
