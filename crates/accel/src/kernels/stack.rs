//! The stack of a traversal, and the order in which children go onto it.
#![allow(unsafe_code, reason = "an uninitialised stack; see each SAFETY note")]

use std::mem::MaybeUninit;

use crate::layout::{ChildRef, Node8, WIDTH};

/// Wide nodes on a way down that the stack has room for.
pub(crate) const MAX_DEPTH: usize = 64;
/// Keys that it has room for.
pub(super) const STACK: usize = MAX_DEPTH * (WIDTH - 1) + WIDTH + 1;

/// A stack of keys: the entry distance in the upper half, the child in the lower.
pub(super) struct Stack<'a> {
    // A reference: kept by value, the compiler fills the array with zeros.
    pub(super) keys: &'a mut MaybeUninit<[u64; STACK]>,
    pub(super) height: usize,
}

impl Stack<'_> {
    /// The place `i`, which must be below [`STACK`].
    #[inline(always)]
    fn at(&mut self, i: usize) -> *mut u64 {
        self.keys.as_mut_ptr().cast::<u64>().wrapping_add(i)
    }

    #[inline(always)]
    pub(super) fn push(&mut self, key: u64) {
        debug_assert!(self.height < STACK);
        // SAFETY: a tree is at most `MAX_DEPTH` deep (its builder sees to it), a node leaves at most seven keys behind
        // on the way down and pushes eight at once, so `height < STACK`.
        unsafe { self.at(self.height).write(key) };
        self.height += 1;
    }

    #[inline(always)]
    pub(super) fn pop(&mut self) -> Option<u64> {
        if self.height == 0 {
            return None;
        }
        self.height -= 1;
        // SAFETY: every place below the old `height` was written by `push`.
        Some(unsafe { self.at(self.height).read() })
    }

    /// Orders the keys from `base` on, greatest first.
    #[inline(always)]
    fn sort_from(&mut self, base: usize) {
        for i in base + 1..self.height {
            // SAFETY: `base ≤ j ≤ i < height`, and every place below `height` was written by `push`.
            unsafe {
                let key = self.at(i).read();
                let mut j = i;
                while j > base && self.at(j - 1).read() < key {
                    self.at(j).write(self.at(j - 1).read());
                    j -= 1;
                }
                self.at(j).write(key);
            }
        }
    }
}

/// The children that a node test left over.
pub(super) struct Met<'a> {
    pub(super) mask: u32,
    pub(super) entry: [f32; WIDTH],
    pub(super) node: &'a Node8,
}

impl Met<'_> {
    /// Takes the next one out.
    #[inline(always)]
    fn next(&mut self) -> u64 {
        let lane = self.mask.trailing_zeros() as usize & (WIDTH - 1);
        self.mask &= self.mask.wrapping_sub(1);
        u64::from(self.entry[lane].to_bits()) << 32 | u64::from(self.node.children[lane].0)
    }
}

/// The nearest of the children that were met; the others go onto the stack, farthest first.
#[inline(always)]
pub(super) fn nearest_first(mut met: Met<'_>, stack: &mut Stack<'_>) -> ChildRef {
    let a = met.next();
    if met.mask == 0 {
        return ChildRef(a as u32);
    }
    let b = met.next();
    let (near, far) = if a < b { (a, b) } else { (b, a) };
    if met.mask == 0 {
        stack.push(far);
        return ChildRef(near as u32);
    }
    let c = met.next();
    if met.mask == 0 {
        // near < far are in order; place c.
        let (middle, last) = if c < far { (c, far) } else { (far, c) };
        let (first, middle) = if middle < near { (middle, near) } else { (near, middle) };
        stack.push(last);
        stack.push(middle);
        return ChildRef(first as u32);
    }
    let base = stack.height;
    stack.push(far);
    stack.push(near);
    stack.push(c);
    while met.mask != 0 {
        let key = met.next();
        stack.push(key);
    }
    stack.sort_from(base);
    ChildRef(stack.pop().unwrap_or_default() as u32)
}
