"""Plain LLVM modules: the code of one C function, without anything of Python or Numba.

Numba adds to each function wrappers for Python, pickled exceptions, and addresses of this process.
A plain module holds only the functions that the C function calls, under short names.
"""

import re

NAME = re.compile(r'@("[^"]+"|[\w.$-]+)')
EXCEPTION = ".const.picklebuf"
GLOBAL = "numba.dynamic.globals"  # an address of this process; a use of it stops the build
ADDRESS = re.compile(rf"({re.escape(EXCEPTION)}|{re.escape(GLOBAL)})\.\w+")
HEAD = 'target triple = "TRIPLE"\ntarget datalayout = "LAYOUT"\n'  # of the machine, set later
_EXCEPTION_TYPE = "{i8*, i32, i8*, i8*, i32}"
_C_TYPES = {"int64": "i64", "uint64": "i64", "float64": "double"}
_C_TYPES |= {f"{name}*": f"{kind}*" for name, kind in _C_TYPES.items()}
_RENAMED = {
    "NRT_MemInfo_alloc_aligned": "robsim.allocate",
    "NRT_MemInfo_call_dtor": "robsim.release",
}


def split_module(text):
    """Return {name: (kind of definition, its text)} of a module.

    Numba names exceptions and globals by the addresses of objects, which differ in each process:
    all have one name here.
    """
    found, lines, i = {}, ADDRESS.sub(r"\1", text).split("\n"), 0
    while i < len(lines):
        line = lines[i]
        if line.startswith("define"):
            first = i
            while lines[i] != "}":
                i += 1
            found[_name_in(line)] = "define", "\n".join(lines[first : i + 1])
        elif line.startswith("declare"):
            found.setdefault(_name_in(line), ("declare", line))
        elif line.startswith("@"):
            found[_name_in(line)] = "global", line
        i += 1
    return found


def _name_in(line):
    return NAME.search(line).group(1).strip('"')


class PlainModules:
    """The plain modules of recorded texts."""

    def __init__(self, texts):
        self.texts = texts
        self.libraries = {name: self._join(modules) for name, modules in texts.modules.items()}

    @staticmethod
    def _join(modules):
        found = {}
        for module in modules:
            for name, each in split_module(module).items():
                if name not in found or found[name][0] == "declare":
                    found[name] = each
        return found

    def make(self, symbol):
        """Return the text of the plain module of a C function."""
        code = self.texts.functions[symbol]
        known = self._definitions(code.library)
        needed = _reach(known, code.name)
        body = "\n".join(_clean(name, *known[name]) for name in sorted(needed))
        defined = sorted(name for name in needed if known[name][0] != "declare" and name != GLOBAL)
        short = {name: f"f{i}" for i, name in enumerate(defined)} | _RENAMED
        text = f"{HEAD}{body}\n{_wrapper(symbol, code)}"
        return NAME.sub(lambda found: "@" + short.get(found[1].strip('"'), found[1]), text)

    def _definitions(self, library):
        """Return the definitions of a library and of the libraries that it calls."""
        reached, waiting = [], [library]
        while waiting:
            name = waiting.pop()
            if name not in reached:
                reached.append(name)
                waiting += self.texts.links.get(name, [])
        known = {}
        for name in reversed(reached):
            for key, each in self.libraries.get(name, {}).items():
                if key not in known or known[key][0] == "declare":
                    known[key] = each
        return known


def _reach(known, first):
    """Return the names of all definitions that a function reaches."""
    reached, waiting = set(), [first]
    while waiting:
        name = waiting.pop()
        if name in reached:
            continue
        if name not in known:
            raise RuntimeError(f"no definition of {name}")
        reached.add(name)
        if name != EXCEPTION:
            waiting += [each.strip('"') for each in NAME.findall(known[name][1])]
    return reached


def _clean(name, kind, text):
    """Return a definition that only its own module sees, in the syntax of any LLVM."""
    if name == EXCEPTION:  # only its status counts
        return f'@"{name}" = internal constant {_EXCEPTION_TYPE} zeroinitializer'
    if name == GLOBAL:
        return f'@"{name}" = external global i8*'
    if kind == "define":
        text = re.sub(r"^define (linkonce_odr |internal )?", "define internal ", text, count=1)
    text = text.replace(" common global", " internal global")
    text = re.sub(r"(captures\(none\)|nocapture) ?", "", text)
    return re.sub(r", ![a-z_.]+ !\d+", "", text)


def _wrapper(symbol, code):
    """Return the C function that calls Numba's function and passes its status on."""
    kinds = [_C_TYPES[kind] for kind in code.kinds]
    result = "i64" if code.returns_status else "i8*"
    arguments = ", ".join(f"{kind} %a{i}" for i, kind in enumerate(kinds))
    lines = [
        f'define {"i64" if code.returns_status else "void"} @"{symbol}"({arguments}) {{',
        f"  %r = alloca {result}",
        f"  %e = alloca {_EXCEPTION_TYPE}*",
        f'  %status = call i32 @"{code.name}"({result}* %r, {_EXCEPTION_TYPE}** %e, {arguments})',
    ]
    if code.returns_status:
        lines += ["  %failed = icmp sgt i32 %status, 0", f"  %v = load {result}, {result}* %r"]
        lines += ["  %w = select i1 %failed, i64 0, i64 %v", "  ret i64 %w", "}"]
    else:
        lines += ["  %failed = icmp sgt i32 %status, 0"]
        lines += ["  br i1 %failed, label %bad, label %good", "bad:"]
        lines += ['  call void @"robsim.fail"(i32 %status)', "  ret void", "good:", "  ret void"]
        lines += ["}", 'declare void @"robsim.fail"(i32)']
    return "\n".join([*lines, ""])
