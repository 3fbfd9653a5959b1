"""Packaging lives in pyproject.toml; this file only names the cffi modules."""

from setuptools import setup

setup(
    cffi_modules=[
        "c_ext/build_ffi.py:engine_ffi",
        "c_ext/build_ffi.py:sync_ffi",
    ]
)
