"""Packaging lives in pyproject.toml; this file only names the cffi modules."""

from setuptools import setup

setup(
    cffi_modules=[
        "c_ext/build_ffi.py:engine_ffi",
        "c_ext/build_ffi.py:sync_ffi",
    ],
    # cffi builds both for the limited API: one wheel for 3.11 and later
    options={"bdist_wheel": {"py_limited_api": "cp311"}},
)
