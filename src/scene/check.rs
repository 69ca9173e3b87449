//! Checks of a document before anything relies on it: indices exist, sizes fit, nodes form
//! no cycle. Nothing is decoded and nothing allocated by a claimed size.

use std::fmt::Display;

use crate::scene::{
    Bytes, Scene, SceneError,
    outline::{Accessor, Index, Mesh, Outline, Primitive},
    resource::Resource,
};

/// Checks the document and the sizes of its buffers.
///
/// # Errors
/// [`SceneError::Invalid`] for the first contradiction, [`SceneError::Uri`] and
/// [`SceneError::Missing`] for buffers that must not or cannot be read.
pub(super) fn check(scene: &Scene) -> Result<(), SceneError> {
    let outline = &scene.outline;
    // First, as views are measured against the `byteLength` that this verifies.
    buffers(scene)?;
    for (i, view) in outline.buffer_views.iter().enumerate() {
        let buffer =
            exists(&format_args!("bufferViews[{i}].buffer"), view.buffer, &outline.buffers)?;
        let end = view.byte_offset.0.checked_add(view.byte_length.0);
        fits(&format_args!("bufferViews[{i}]"), end, buffer.byte_length.0)?;
    }
    for (i, accessor) in outline.accessors.iter().enumerate() {
        check_accessor(outline, i, accessor)?;
    }
    for (i, image) in outline.images.iter().enumerate() {
        optional(
            &format_args!("images[{i}].bufferView"),
            image.buffer_view,
            &outline.buffer_views,
        )?;
    }
    for (i, texture) in outline.textures.iter().enumerate() {
        optional(&format_args!("textures[{i}].source"), texture.source, &outline.images)?;
        optional(&format_args!("textures[{i}].sampler"), texture.sampler, &outline.samplers)?;
    }
    for (i, mesh) in outline.meshes.iter().enumerate() {
        check_mesh(outline, i, mesh)?;
    }
    for (i, skin) in outline.skins.iter().enumerate() {
        let matrices = skin.inverse_bind_matrices;
        all(&format_args!("skins[{i}].joints"), &skin.joints, &outline.nodes)?;
        optional(&format_args!("skins[{i}].inverseBindMatrices"), matrices, &outline.accessors)?;
    }
    for (i, animation) in outline.animations.iter().enumerate() {
        for sampler in &animation.samplers {
            all(
                &format_args!("animations[{i}].samplers"),
                &[sampler.input, sampler.output],
                &outline.accessors,
            )?;
        }
    }
    nodes(outline)
}

/// The data of every buffer is as long as its `byteLength` claims.
fn buffers(scene: &Scene) -> Result<(), SceneError> {
    for (i, buffer) in scene.outline.buffers.iter().enumerate() {
        let length = match (&buffer.uri, &scene.bin) {
            (Some(uri), _) => match Resource::new(uri)? {
                Some(resource) => {
                    let path = resource.locate(scene.folder())?;
                    path.metadata()?.len()
                }
                // A data URI is measured where it is decoded, in `pack_buffers`.
                None => continue,
            },
            (None, Some(bin)) if i == 0 => bin.iter().map(Bytes::len).sum(),
            // A placeholder whose content an extension makes.
            (None, _) => continue,
        };
        // More data than claimed is fine: BIN is padded to a multiple of four.
        if buffer.byte_length.0 > length {
            let reason = format!("claims {} bytes, its data has {length}", buffer.byte_length.0);
            return Err(SceneError::Invalid(format!("buffers[{i}]"), reason));
        }
    }
    Ok(())
}

fn check_accessor(outline: &Outline, i: usize, accessor: &Accessor) -> Result<(), SceneError> {
    let place = format!("accessors[{i}].bufferView");
    let view = optional(&place, accessor.buffer_view, &outline.buffer_views)?;
    if let Some(sparse) = &accessor.sparse {
        let views = [sparse.indices.buffer_view, sparse.values.buffer_view];
        all(&format_args!("accessors[{i}].sparse"), &views, &outline.buffer_views)?;
        fits(&format_args!("accessors[{i}].sparse.count"), Some(sparse.count.0), accessor.count.0)?;
    }
    // Without a view the elements are zeros; without an element there is no last one.
    if let (Some(view), Some(size), Some(last)) =
        (view, element_size(accessor), accessor.count.0.checked_sub(1))
    {
        let stride = view.byte_stride.map_or(size, |stride| stride.0);
        // The last element takes `size`, not `stride`: the gap behind it may lie outside.
        let end = last
            .checked_mul(stride)
            .and_then(|start| start.checked_add(size))
            .and_then(|end| end.checked_add(accessor.byte_offset.0));
        fits(&format_args!("accessors[{i}]"), end, view.byte_length.0)?;
    }
    Ok(())
}

/// Bytes of one element; `None` for types of extensions. Matrix columns start at multiples of 4.
fn element_size(accessor: &Accessor) -> Option<u64> {
    // Bytes, 16 bits, then 32-bit integers and floats, by their numbers in glTF.
    let component = match accessor.component_type.0 {
        5120 | 5121 => 1,
        5122 | 5123 => 2,
        5125 | 5126 => 4,
        _ => return None,
    };
    Some(match &*accessor.kind {
        "SCALAR" => component,
        "VEC2" => 2 * component,
        "VEC3" => 3 * component,
        "VEC4" => 4 * component,
        "MAT2" => 2 * column(2, component),
        "MAT3" => 3 * column(3, component),
        "MAT4" => 4 * column(4, component),
        _ => return None,
    })
}

/// Bytes of a column of a matrix.
fn column(rows: u64, component: u64) -> u64 {
    (rows * component).next_multiple_of(4)
}

fn check_mesh(outline: &Outline, i: usize, mesh: &Mesh) -> Result<(), SceneError> {
    for (j, primitive) in mesh.primitives.iter().enumerate() {
        let Primitive { attributes, indices, material, targets, extensions, .. } = primitive;
        let place = format!("meshes[{i}].primitives[{j}]");
        optional(&format_args!("{place}.material"), *material, &outline.materials)?;
        optional(&format_args!("{place}.indices"), *indices, &outline.accessors)?;
        for (name, accessor) in attributes.iter().chain(targets.iter().flatten()) {
            exists(&format_args!("{place}: {name}"), *accessor, &outline.accessors)?;
        }
        for mapping in extensions.variants.iter().flat_map(|variants| &variants.mappings) {
            exists(&format_args!("{place}: a variant"), mapping.material, &outline.materials)?;
        }
    }
    Ok(())
}

/// Node references exist, and no node is its own descendant.
fn nodes(outline: &Outline) -> Result<(), SceneError> {
    let nodes = &outline.nodes;
    optional(&"scene", outline.scene, &outline.scenes)?;
    for (i, scene) in outline.scenes.iter().enumerate() {
        all(&format_args!("scenes[{i}].nodes"), &scene.nodes, nodes)?;
    }
    let mut parents = vec![0usize; nodes.len()];
    for (i, node) in nodes.iter().enumerate() {
        optional(&format_args!("nodes[{i}].mesh"), node.mesh, &outline.meshes)?;
        optional(&format_args!("nodes[{i}].skin"), node.skin, &outline.skins)?;
        optional(&format_args!("nodes[{i}].camera"), node.camera, &outline.cameras)?;
        all(&format_args!("nodes[{i}].children"), &node.children, nodes)?;
        // `all` has checked that the children exist.
        node.children.iter().for_each(|child| parents[child.0 as usize] += 1);
    }
    acyclic(outline, parents)
}

/// Takes away roots until none is left; what remains lies on or below a cycle.
fn acyclic(outline: &Outline, mut parents: Vec<usize>) -> Result<(), SceneError> {
    let mut roots: Vec<usize> = (0..parents.len()).filter(|i| parents[*i] == 0).collect();
    let mut left = parents.len();
    while let Some(root) = roots.pop() {
        left -= 1;
        for Index(child) in &outline.nodes[root].children {
            let child = *child as usize;
            parents[child] -= 1;
            if parents[child] == 0 {
                roots.push(child);
            }
        }
    }
    match parents.iter().position(|count| *count > 0) {
        Some(node) if left > 0 => {
            Err(invalid(&format_args!("nodes[{node}]"), "is on or below a cycle of nodes"))
        }
        _ => Ok(()),
    }
}

fn exists<'a, T>(place: &dyn Display, index: Index, items: &'a [T]) -> Result<&'a T, SceneError> {
    let item = usize::try_from(index.0).ok().and_then(|index| items.get(index));
    item.ok_or_else(|| invalid(place, format!("is {}, there are {}", index.0, items.len())))
}

fn optional<'a, T>(
    place: &dyn Display,
    index: Option<Index>,
    items: &'a [T],
) -> Result<Option<&'a T>, SceneError> {
    index.map(|index| exists(place, index, items)).transpose()
}

fn all<T>(place: &dyn Display, indices: &[Index], items: &[T]) -> Result<(), SceneError> {
    indices.iter().try_for_each(|index| exists(place, *index, items).map(|_| ()))
}

fn fits(place: &dyn Display, end: Option<u64>, limit: u64) -> Result<(), SceneError> {
    match end {
        Some(end) if end <= limit => Ok(()),
        Some(end) => Err(invalid(place, format!("reaches {end}, the limit is {limit}"))),
        None => Err(invalid(place, "is larger than any file")),
    }
}

fn invalid(place: &dyn Display, reason: impl Into<String>) -> SceneError {
    SceneError::Invalid(place.to_string(), reason.into())
}
