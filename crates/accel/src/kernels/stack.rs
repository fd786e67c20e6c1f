//! The stack of a traversal, and the order in which children go onto it.
#![allow(unsafe_code, reason = "an uninitialised stack; see each SAFETY note")]

use std::mem::MaybeUninit;

use crate::layout::{ChildRef, NODE, Node};

/// Wide nodes on a way down that the stack has room for.
pub(crate) const MAX_DEPTH: usize = 64;
/// Keys that it has room for.
pub(super) const STACK: usize = MAX_DEPTH * (NODE - 1) + NODE + 1;

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
    fn push(&mut self, key: u64) {
        debug_assert!(self.height < STACK);
        // SAFETY: a tree is at most `MAX_DEPTH` deep (its builder sees to it), a node leaves at most seven keys behind
        // on the way down and pushes eight at once, so `height < STACK`.
        unsafe { self.at(self.height).write(key) };
        self.height += 1;
    }

    #[inline(always)]
    fn pop(&mut self) -> Option<u64> {
        if self.height == 0 {
            return None;
        }
        self.height -= 1;
        // SAFETY: every place below the old `height` was written by `push`.
        Some(unsafe { self.at(self.height).read() })
    }

    /// Puts a key among those from `base` on, which are in order, greatest first.
    #[inline(always)]
    fn push_in_order(&mut self, base: usize, key: u64) {
        let mut j = self.height;
        self.push(key);
        // SAFETY: `base ≤ j < height`, and every place below `height` was written by `push`.
        unsafe {
            while j > base && self.at(j - 1).read() < key {
                self.at(j).write(self.at(j - 1).read());
                j -= 1;
            }
            self.at(j).write(key);
        }
    }

    /// The next child that is not behind `t`; distances do not count if any hit will do.
    #[inline(always)]
    pub(super) fn pop_until<const ANY: bool>(&mut self, t: f32) -> Option<ChildRef> {
        loop {
            let key = self.pop()?;
            if ANY || f32::from_bits((key >> 32) as u32) <= t {
                return Some(ChildRef(key as u32));
            }
        }
    }
}

/// Of the children in `mask`: the distance in the upper half, the child in the lower.
#[inline(always)]
fn key(lane: u32, entries: &[f32; NODE], node: &Node) -> u64 {
    let lane = lane as usize & (NODE - 1);
    u64::from(entries[lane].to_bits()) << 32 | u64::from(node.children[lane].0)
}

/// The biggest of the children that were met; the others go onto the stack. `None` if there are none.
#[inline(always)]
pub(super) fn biggest_first(mut mask: u32, node: &Node, stack: &mut Stack<'_>) -> Option<ChildRef> {
    if mask == 0 {
        return None;
    }
    // In the order of the slots: the last, which is the biggest, comes first.
    let last = 31 - mask.leading_zeros();
    mask ^= 1 << last;
    while mask != 0 {
        stack.push(u64::from(node.children[mask.trailing_zeros() as usize & (NODE - 1)].0));
        mask &= mask - 1;
    }
    Some(node.children[last as usize & (NODE - 1)])
}

/// The nearest of the children that were met; the others go onto the stack, farthest first. `None` if there are none.
#[inline(always)]
pub(super) fn nearest_first(
    mask: u32,
    entries: &[f32; NODE],
    node: &Node,
    stack: &mut Stack<'_>,
) -> Option<ChildRef> {
    if mask == 0 {
        return None;
    }
    let first = mask.trailing_zeros();
    let mask = mask & (mask - 1);
    if mask == 0 {
        return Some(node.children[first as usize & (NODE - 1)]);
    }
    let (a, b) = (key(first, entries, node), key(mask.trailing_zeros(), entries, node));
    let (near, far) = if a < b { (a, b) } else { (b, a) };
    let mask = mask & (mask - 1);
    if mask == 0 {
        stack.push(far);
        return Some(ChildRef(near as u32));
    }
    let c = key(mask.trailing_zeros(), entries, node);
    let (middle, last) = if c < far { (c, far) } else { (far, c) };
    let (first, middle) = if middle < near { (middle, near) } else { (near, middle) };
    let mut mask = mask & (mask - 1);
    let base = stack.height;
    stack.push(last);
    stack.push(middle);
    if mask == 0 {
        return Some(ChildRef(first as u32));
    }
    stack.push(first);
    while mask != 0 {
        stack.push_in_order(base, key(mask.trailing_zeros(), entries, node));
        mask &= mask - 1;
    }
    stack.pop().map(|key| ChildRef(key as u32))
}
