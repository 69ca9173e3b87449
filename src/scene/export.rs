//! A scene and its assignments become files.

use std::path::Path;

use crate::asset::Asset;
use crate::scene::job::Job;
use crate::scene::material::{self, extensions_of};
use crate::scene::output_file::Export;
use crate::scene::prune::replaced;
use crate::scene::text::Pieces;
use crate::scene::{Scene, SceneError, SlotId, fingerprint};

impl Scene {
    /// The files of the scene with assets in its slots, for `target` (.glb or .gltf, which
    /// may differ from the input's container). Without an asset and in the input's container
    /// the document comes out byte for byte. Files that the document names are part of the export
    /// where the target lies in another folder.
    ///
    /// # Errors
    /// Missing resources, and what [`Container::of`] refuses.
    pub fn export(
        &self,
        assigned: &[(SlotId, &Asset)],
        target: &Path,
    ) -> Result<Export, SceneError> {
        let mut job = self.job(target, &replaced(assigned))?;
        job.assign(assigned)?;
        job.finish(target, !assigned.is_empty())
    }
}

impl Job<'_> {
    fn assign(&mut self, assigned: &[(SlotId, &Asset)]) -> Result<(), SceneError> {
        // One mark is enough.
        let mut mark = Some(fingerprint::PLACEHOLDER.to_owned());
        for (slot, asset) in assigned {
            let mark = mark.take();
            let textures = self.attach_all(asset)?;
            match slot {
                SlotId::Material(index) => {
                    let warnings = &mut self.warnings;
                    self.draft.edit("materials", *index, |raw| {
                        let losses = material::losses(raw)?.into_iter();
                        warnings.extend(losses.map(|loss| format!("material {index}: {loss}")));
                        material::replace(raw, asset, textures, mark)
                    })?;
                }
                SlotId::Unassigned => {
                    // The new material goes last, so that no index changes.
                    let material = material::replace("{}", asset, textures, mark)?;
                    let index = self.draft.append("materials", material)?;
                    self.assign_bare_primitives(index)?;
                }
            }
            self.draft.declare(extensions_of(asset))?;
        }
        Ok(())
    }

    /// Primitives without a material get the one at `index`.
    fn assign_bare_primitives(&mut self, index: usize) -> Result<(), SceneError> {
        for (at, mesh) in self.scene.outline.meshes.iter().enumerate() {
            let bare: Vec<usize> = (0..mesh.primitives.len())
                .filter(|i| mesh.primitives[*i].material.is_none())
                .collect();
            if bare.is_empty() {
                continue;
            }
            self.draft.edit("meshes", at, |raw| {
                let mut mesh = Pieces::object(raw)?;
                let mut primitives = Pieces::array(mesh.original("primitives").unwrap_or("[]"))?;
                for i in bare {
                    let raw = primitives.item(i).unwrap_or("{}").to_owned();
                    let mut primitive = Pieces::object(&raw)?;
                    primitive.set("material", index.to_string());
                    primitives.replace(i, primitive.to_text());
                }
                mesh.set("primitives", primitives.to_text());
                Ok(mesh.to_text())
            })?;
        }
        Ok(())
    }
}
