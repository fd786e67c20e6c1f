//! glTF, text and binary.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod common;

target!(|bytes: &[u8]| common::read("a.glb", &[("a.glb", bytes)]));
