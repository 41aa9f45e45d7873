"""Prints the layout of what a header declares, as Python's cffi reads it.

Arguments: the preprocessed header, and a file with its `#define`s. One line each: `CONSTANT value`,
`struct size alignment`, `struct.field offset size alignment`. Negative constants are printed as their two's complement.
"""

import pathlib
import sys

import cffi

declarations, constants = (pathlib.Path(path).read_text() for path in sys.argv[1:])
names = [line.split()[1] for line in constants.splitlines()]
ffi = cffi.FFI()
ffi.cdef(declarations + constants)
# Whatever library: its functions are not looked up.
values = ffi.dlopen(None)
for name in names:
    print(name, getattr(values, name) % 2**64)
for name in ffi.list_types()[0]:
    kind = ffi.typeof(name)
    if kind.kind != "struct":
        continue
    print(name, ffi.sizeof(kind), ffi.alignof(kind))
    for field, place in kind.fields:
        print(f"{name}.{field}", place.offset, ffi.sizeof(place.type), ffi.alignof(place.type))
