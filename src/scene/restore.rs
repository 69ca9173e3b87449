//! The extension is rebuilt from the parameters in `extras.sgd`, which tools that drop unknown
//! extensions keep.

use std::collections::BTreeSet;
use std::path::Path;

use crate::asset::{Asset, EXTENSION, Extras};
use crate::scene::{Export, Scene, SceneError, fingerprint, material};

impl Scene {
    /// The parameters in the extras of each material that has them, by material index.
    ///
    /// # Errors
    /// [`SceneError::Extras`] for the first that cannot be read.
    pub fn extras(&self) -> Result<Vec<(usize, Extras)>, SceneError> {
        let mut found = Vec::new();
        for (index, material) in self.outline.materials.iter().enumerate() {
            let Some(body) = material.sgd_extras() else { continue };
            let extras = Extras::read(&body).map_err(|source| {
                let name = material.name.clone().unwrap_or_default();
                SceneError::Extras { index, name, source }
            })?;
            found.push((index, extras));
        }
        Ok(found)
    }

    /// The files of the scene with the extension of each asset in its material, and with the
    /// assets' textures. Everything else, the glTF material included, is as it was.
    ///
    /// # Errors
    /// As [`Scene::export`]; [`SceneError::Invalid`] where there is no such material.
    pub fn restored(
        &self,
        assets: &[(usize, &Asset)],
        target: &Path,
    ) -> Result<Export, SceneError> {
        let mut job = self.job(target, &assets.iter().map(|(index, _)| *index).collect())?;
        // One mark is enough.
        let mut mark = Some(fingerprint::PLACEHOLDER.to_owned());
        for (index, asset) in assets {
            let textures = job.attach_all(asset)?;
            let mark = mark.take();
            job.draft.edit("materials", *index, |raw| {
                material::restore(raw, &asset.material, textures, mark)
            })?;
        }
        // The scene still has the extensions as they were read; only the draft is changed.
        for (index, extension) in self.measured() {
            let asset = assets.iter().find(|(restored, _)| *restored == index);
            if let Some(((_, asset), Ok(extension))) = asset.zip(Some(extension))
                && asset.material.parameters != extension.material.parameters
            {
                let warning = "its extras and its extension differ; the extras count";
                job.warnings.push(format!("material {index}: {warning}"));
            }
        }
        job.draft.declare(assets.iter().map(|_| EXTENSION))?;
        job.finish(target, !assets.is_empty())
    }

    /// The scene without the lookup textures that the extensions of these materials, and nothing
    /// else, have.
    ///
    /// # Errors
    /// Materials that are not valid JSON objects.
    pub fn without_lookups(self, materials: &BTreeSet<usize>) -> Result<Self, SceneError> {
        self.without_content(&BTreeSet::new(), materials)
    }
}
