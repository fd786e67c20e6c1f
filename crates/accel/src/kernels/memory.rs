//! Big arrays on big pages: fewer address translations while traversing.
#![allow(unsafe_code, reason = "advice to the system; see each SAFETY note")]

use rayon::prelude::*;

/// An array with room for `n` values, on pages of 2 MiB where the system has them to give.
pub(crate) fn with_capacity<T>(n: usize) -> Vec<T> {
    let values = Vec::<T>::with_capacity(n);
    advise(values.as_ptr().cast(), n * size_of::<T>());
    values
}

/// An array of `n` equal values on such pages, written by all threads.
pub(crate) fn filled<T: Clone + Send>(n: usize, value: T) -> Vec<T> {
    let mut values = with_capacity(n);
    rayon::iter::repeat_n(value, n).collect_into_vec(&mut values);
    values
}

#[cfg(target_os = "linux")]
fn advise(start: *const u8, bytes: usize) {
    use std::ffi::{c_int, c_void};

    const PAGE: usize = 4096;
    const BIG: usize = 1 << 21;
    const MADV_HUGEPAGE: c_int = 14;
    unsafe extern "C" {
        fn madvise(start: *mut c_void, bytes: usize, advice: c_int) -> c_int;
    }

    let skip = start.addr().next_multiple_of(PAGE) - start.addr();
    if bytes < 2 * BIG {
        return;
    }
    let whole = (bytes - skip) / PAGE * PAGE;
    // SAFETY: the advice changes no contents, and the range is whole pages of a live allocation. If it is refused,
    // the pages stay small.
    let _ = unsafe { madvise(start.wrapping_add(skip).cast_mut().cast(), whole, MADV_HUGEPAGE) };
}

#[cfg(not(target_os = "linux"))]
fn advise(_: *const u8, _: usize) {}

/// Begins to load a value into the nearest cache.
#[inline(always)]
pub(crate) fn fetch<T>(value: *const T) {
    let start: *const i8 = value.cast();
    for line in (0..size_of::<T>()).step_by(64) {
        #[cfg(target_arch = "x86_64")]
        // SAFETY: a prefetch is allowed at any address.
        unsafe {
            std::arch::x86_64::_mm_prefetch::<{ std::arch::x86_64::_MM_HINT_T0 }>(start.wrapping_add(line));
        }
        #[cfg(not(target_arch = "x86_64"))]
        let _ = start.wrapping_add(line);
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn big_and_small_arrays_have_their_room() {
        for n in [0, 1, 100, 1 << 20] {
            let mut values = super::with_capacity::<u64>(n);
            values.resize(n, 7);
            assert!(values.capacity() >= n && values.iter().all(|&x| x == 7));
            assert_eq!(super::filled(n, 7_u64), values);
        }
    }
}
