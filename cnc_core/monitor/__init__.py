"""The machine in the browser: a server beside a cell, and its page.

The server looks at the cell through a mapping that it cannot write.  What a
page asks for goes to the PLC, as ``hli-cosim force`` does it.
"""
