//! Nested dielectrics: which of the bodies that overlap at a point fills it [Schmidt2002].
//!
//! A body is what surfaces of a material with a priority bound, closed. Where bodies overlap, the one of the highest priority
//! fills the place and displaces the others, and what has no priority; of bodies of one priority the one whose material
//! comes later. A walk carries what it is in, so that a surface knows its two sides: it is a border only where its own body
//! fills the place behind it, and its index of refraction is over that of what fills the place before it. Elsewhere it is
//! not there. All this is a function of the point, whichever way a walk came: ids of bodies are in the order of their
//! strength, and what a walk is in is kept sorted.
//!
//! Departs from the paper: interior lists hold bodies and not objects, so that surfaces of one material may overlap; and
//! equal priorities are decided.

use crate::{MaterialId, MediumId};

/// A body of the scene, by its strength: from 1 on, a higher one displaces a lower one.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct BodyId(u16);

/// What a body is made of.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) struct Body {
    pub(crate) priority: i32,
    pub(crate) material: MaterialId,
    /// In it.
    pub(crate) medium: Option<MediumId>,
}

/// Bodies around one point that are kept; of more the weakest are forgotten.
const MOST: usize = 8;

/// Bodies that a point is in, strongest first; zeros after the last. A body that overlaps itself is in it as often.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Enclosing([u16; MOST]);

impl Enclosing {
    /// The one that fills the place.
    pub(crate) fn strongest(&self) -> Option<BodyId> {
        Some(BodyId(self.0[0])).filter(|b| b.0 > 0)
    }

    /// With one more.
    #[must_use]
    pub(crate) fn with(mut self, BodyId(body): BodyId) -> Self {
        let at = self.0.iter().position(|b| *b < body).unwrap_or(MOST);
        if at < MOST {
            self.0.copy_within(at..MOST - 1, at + 1);
            self.0[at] = body;
        }
        self
    }

    /// With one less; `None` if it is not in it.
    pub(crate) fn without(mut self, BodyId(body): BodyId) -> Option<Self> {
        let at = self.0.iter().position(|b| *b == body)?;
        self.0.copy_within(at + 1.., at);
        self.0[MOST - 1] = 0;
        Some(self)
    }
}

/// What a ray is in: a medium, and the bodies that may be left again.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Surroundings {
    /// What fills the place.
    medium: Option<MediumId>,
    /// What would if there were no body.
    ambient: Option<MediumId>,
    bodies: Enclosing,
}

impl Surroundings {
    /// In a medium, or in nothing, and in no body.
    #[must_use]
    pub fn of(medium: Option<MediumId>) -> Self {
        Self { medium, ambient: medium, bodies: Enclosing::default() }
    }

    /// The medium that fills the place.
    #[inline]
    #[must_use]
    pub fn medium(&self) -> Option<MediumId> {
        self.medium
    }

    pub(crate) fn bodies(&self) -> Enclosing {
        self.bodies
    }

    pub(crate) fn ambient(&self) -> Option<MediumId> {
        self.ambient
    }
}

/// All bodies of a scene, by [`BodyId`].
#[derive(Clone, Debug, Default)]
pub(crate) struct Bodies {
    /// Sorted.
    list: Vec<Body>,
}

impl Bodies {
    /// Of the bodies of all shapes, in any order and as often as they come.
    pub(crate) fn new(mut list: Vec<Body>) -> Self {
        list.sort_unstable();
        list.dedup();
        Self { list }
    }

    /// None at all?
    #[inline]
    pub(crate) fn is_empty(&self) -> bool {
        self.list.is_empty()
    }

    /// The id of a body; `None` if there are more than ids.
    pub(crate) fn id(&self, body: &Body) -> Option<BodyId> {
        let at = self.list.binary_search(body).ok()?;
        u16::try_from(at + 1).ok().map(BodyId)
    }

    pub(crate) fn get(&self, id: BodyId) -> &Body {
        &self.list[usize::from(id.0) - 1]
    }

    /// In these bodies, before this ambient medium.
    pub(crate) fn surroundings(&self, bodies: Enclosing, ambient: Option<MediumId>) -> Surroundings {
        let medium = bodies.strongest().map_or(ambient, |b| self.get(b).medium);
        Surroundings { medium, ambient, bodies }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn inside(bodies: &[u16]) -> Enclosing {
        bodies.iter().fold(Enclosing::default(), |all, b| all.with(BodyId(*b)))
    }

    #[test]
    fn what_a_point_is_in_does_not_depend_on_the_way_there() {
        let a = inside(&[3, 1, 2, 2]);
        assert_eq!(a, inside(&[2, 3, 2, 1]));
        assert_eq!(a.strongest(), Some(BodyId(3)));
        assert_eq!(a.without(BodyId(3)).and_then(|a| a.strongest()), Some(BodyId(2)));
        // A body that overlaps itself is left as often as it was entered.
        let once = a.without(BodyId(2)).unwrap();
        assert!(once.without(BodyId(2)).is_some_and(|none| none.without(BodyId(2)).is_none()));
        assert_eq!(a.without(BodyId(7)), None);
        assert_eq!(inside(&[]).strongest(), None);
    }

    #[test]
    fn of_too_many_bodies_the_weakest_are_forgotten() {
        let many = inside(&[9, 1, 8, 2, 7, 3, 6, 4, 5]);
        assert!((2..10).all(|b| many.without(BodyId(b)).is_some()) && many.without(BodyId(1)).is_none());
        assert_eq!(many.with(BodyId(1)), many);
        assert_eq!(many.with(BodyId(20)).strongest(), Some(BodyId(20)));
    }

    #[test]
    fn bodies_are_numbered_by_their_strength() {
        let body = |priority, material| Body { priority, material: MaterialId(material), medium: None };
        let bodies = Bodies::new(vec![body(2, 0), body(-1, 5), body(2, 3), body(2, 0)]);
        let ids: Vec<_> = [body(-1, 5), body(2, 0), body(2, 3)].iter().map(|b| bodies.id(b)).collect();
        assert_eq!(ids, [Some(BodyId(1)), Some(BodyId(2)), Some(BodyId(3))]);
        assert_eq!(bodies.id(&body(0, 0)), None);
        let medium = Some(MediumId(4));
        assert_eq!(bodies.surroundings(Enclosing::default(), medium), Surroundings::of(medium));
        let filled = bodies.surroundings(inside(&[1]), medium);
        assert_eq!((filled.medium(), filled.ambient()), (None, medium));
    }
}
