//! The film: exact accumulation, filters, merging and partial files.
