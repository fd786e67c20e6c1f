//! Media and their phase functions.

use scene_desc::{MediumDesc, MediumId, MediumKind};

use super::build::Build;
use super::tree::{Class, NodeId};

impl Build<'_, '_, '_> {
    /// The medium of a node, made once.
    pub(super) fn medium(&mut self, id: NodeId) -> Option<MediumId> {
        let node = self.tree.node(id);
        if node.class != Class::Medium {
            return self.refuse(node.span, format!("{} is no medium", node.title()), "expected a medium");
        }
        if let Some(found) = self.media.get(&id) {
            return Some(*found);
        }
        self.unsupported(node, "it is treated as empty");
        let name = node.id.clone().unwrap_or_default();
        let kind = MediumKind::Unsupported(node.kind.clone());
        self.scene.media.push(MediumDesc { name, kind, span: node.span });
        let medium = MediumId(u32::try_from(self.scene.media.len() - 1).unwrap_or(u32::MAX));
        self.media.insert(id, medium);
        Some(medium)
    }
}
