//! Partial films, as files and on their way through a cluster.
#![cfg_attr(feature = "libfuzzer", no_main)]

mod common;

target!(|bytes: &[u8]| {
    let _ = film::Film::from_bytes(bytes);
});
