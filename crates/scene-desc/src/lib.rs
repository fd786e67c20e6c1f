//! A scene as plain data: what files, Python and the web make; defaults, units, diagnostics, validation.
