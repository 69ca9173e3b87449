//! The shape in front of the camera: a ball, or a mesh turned to face it.

use bvh::aabb::{Aabb, Bounded};
use bvh::bounding_hierarchy::BHShape;
use bvh::bvh::Bvh;
use bvh::ray::Ray;
use glam::DVec3;
use nalgebra::{Point3, Vector3};

use crate::preview::ball::{TO_VIEWER, normal_at};
use crate::scene;

/// The shape in front of the camera.
///
/// # Example
///
/// ```
/// use sgdbake::Shape;
///
/// assert!(Shape::Ball.seen_at(0.0, 0.0).is_some(), "the centre of the picture");
/// assert!(Shape::Ball.seen_at(0.99, 0.99).is_none(), "its corner");
/// ```
#[derive(Debug)]
pub enum Shape {
    /// The unit ball.
    Ball,
    /// Triangles, scaled to the unit ball around the origin.
    Mesh(Mesh),
}

/// A point that the camera sees.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hit {
    /// Where it is.
    pub point: DVec3,
    /// Unit shading normal, towards the viewer.
    pub normal: DVec3,
}

impl Shape {
    /// The nearest point at (x, y) of the picture plane.
    #[must_use]
    pub fn seen_at(&self, x: f64, y: f64) -> Option<Hit> {
        match self {
            Self::Ball => normal_at(x, y).map(|normal| Hit { point: normal, normal }),
            Self::Mesh(mesh) => mesh.seen_at(x, y),
        }
    }

    /// Returns whether something of the shape lies between `hit` and the light.
    #[must_use]
    pub fn shadows(&self, hit: &Hit, to_light: DVec3) -> bool {
        match self {
            Self::Ball => false,
            Self::Mesh(mesh) => mesh.shadows(hit, to_light),
        }
    }
}

/// Triangles under a bounding volume hierarchy.
#[derive(Debug)]
pub struct Mesh {
    triangles: Vec<Triangle>,
    hierarchy: Bvh<f64, 3>,
}

/// A triangle with a normal at each corner.
#[derive(Clone, Copy, Debug)]
pub struct Triangle {
    /// Corners.
    pub corners: [DVec3; 3],
    /// Unit normals at the corners.
    pub normals: [DVec3; 3],
    node: usize,
}

impl Triangle {
    /// A triangle; with no normals it is flat.
    #[must_use]
    pub fn new(corners: [DVec3; 3], normals: Option<[DVec3; 3]>) -> Self {
        let [a, b, c] = corners;
        let flat = (b - a).cross(c - a).normalize_or(DVec3::Z);
        Self { corners, normals: normals.unwrap_or([flat; 3]), node: 0 }
    }

    /// Distance along a ray and the barycentric coordinates of its hit (Möller and Trumbore 1997).
    fn intersect(&self, origin: DVec3, direction: DVec3) -> Option<(f64, [f64; 3])> {
        let [a, b, c] = self.corners;
        let (ab, ac) = (b - a, c - a);
        let across = direction.cross(ac);
        // Infinite for a ray in the plane: v and w are then infinite or NaN, and miss.
        let inverse = ab.dot(across).recip();
        let from_a = origin - a;
        let v = from_a.dot(across) * inverse;
        let around = from_a.cross(ab);
        let w = direction.dot(around) * inverse;
        let distance = ac.dot(around) * inverse;
        let inside = v >= 0.0 && w >= 0.0 && v + w <= 1.0 && distance > 0.0;
        inside.then_some((distance, [1.0 - v - w, v, w]))
    }
}

impl From<scene::Triangle> for Triangle {
    fn from(triangle: scene::Triangle) -> Self {
        Self::new(triangle.corners, triangle.normals)
    }
}

impl Bounded<f64, 3> for Triangle {
    fn aabb(&self) -> Aabb<f64, 3> {
        self.corners.iter().fold(Aabb::empty(), |bounds, corner| bounds.grow(&point(*corner)))
    }
}

impl BHShape<f64, 3> for Triangle {
    fn set_bh_node_index(&mut self, index: usize) {
        self.node = index;
    }

    fn bh_node_index(&self) -> usize {
        self.node
    }
}

/// Beyond the unit ball, where camera rays start.
const CAMERA_DISTANCE: f64 = 2.0;

/// How far a shadow ray starts off the surface, in units of the mesh's radius.
const SHADOW_OFFSET: f64 = 1e-5;

impl Mesh {
    /// The triangles moved and scaled into the unit ball; `None` without a triangle of finite size.
    #[must_use]
    pub fn new(mut triangles: Vec<Triangle>) -> Option<Self> {
        let corners = triangles.iter().flat_map(|t| t.corners);
        let low = corners.clone().reduce(DVec3::min)?;
        let high = corners.clone().reduce(DVec3::max)?;
        let centre = 0.5 * (low + high);
        let radius = corners.map(|corner| corner.distance(centre)).fold(0.0, f64::max);
        // All corners in one place, or a corner that is not finite.
        if !(radius.is_finite() && radius > 0.0) {
            return None;
        }
        for triangle in &mut triangles {
            triangle.corners = triangle.corners.map(|corner| (corner - centre) / radius);
        }
        let hierarchy = Bvh::build(&mut triangles);
        Some(Self { triangles, hierarchy })
    }

    fn seen_at(&self, x: f64, y: f64) -> Option<Hit> {
        let origin = DVec3::new(x, y, CAMERA_DISTANCE);
        let hits = self.along(origin, -TO_VIEWER);
        let (distance, normal) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
        // Seen from behind, a surface is shaded as its back.
        let normal = if normal.dot(TO_VIEWER) < 0.0 { -normal } else { normal };
        Some(Hit { point: origin - distance * TO_VIEWER, normal })
    }

    fn shadows(&self, hit: &Hit, to_light: DVec3) -> bool {
        // Off along the normal and towards the light, or the hit triangle would shadow itself.
        self.along(hit.point + SHADOW_OFFSET * (hit.normal + to_light), to_light).next().is_some()
    }

    /// Distance and shading normal of every triangle on a ray.
    fn along(&self, origin: DVec3, direction: DVec3) -> impl Iterator<Item = (f64, DVec3)> {
        let ray = Ray::new(point(origin), Vector3::new(direction.x, direction.y, direction.z));
        // The hierarchy gives all triangles whose boxes the ray meets, in no order of distance.
        let near = self.hierarchy.traverse(&ray, &self.triangles).into_iter();
        near.filter_map(move |triangle| {
            let (distance, [a, b, c]) = triangle.intersect(origin, direction)?;
            let [na, nb, nc] = triangle.normals;
            Some((distance, (a * na + b * nb + c * nc).normalize_or(DVec3::Z)))
        })
    }
}

fn point(v: DVec3) -> Point3<f64> {
    Point3::new(v.x, v.y, v.z)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An octahedron, corners on the axes.
    fn octahedron() -> Mesh {
        let mut triangles = Vec::new();
        for signs in 0..8 {
            let corners = [DVec3::X, DVec3::Y, DVec3::Z];
            let corners = [0, 1, 2].map(|bit| {
                if signs >> bit & 1 == 0 { 5.0 * corners[bit] } else { -5.0 * corners[bit] }
            });
            triangles.push(Triangle::new(corners, Some(corners.map(DVec3::normalize))));
        }
        Mesh::new(triangles).expect("a solid")
    }

    #[test]
    fn the_camera_sees_the_nearest_face() {
        let mesh = octahedron();
        let hit = mesh.seen_at(0.1, 0.2).expect("in front of it");
        assert!((hit.point - DVec3::new(0.1, 0.2, 0.7)).length() < 1e-12);
        assert!((hit.normal - DVec3::new(0.1, 0.2, 0.7).normalize()).length() < 1e-12);
        assert!(mesh.seen_at(0.7, 0.7).is_none());
    }

    #[test]
    fn a_solid_shadows_itself_from_below_only() {
        let shape = Shape::Mesh(octahedron());
        let hit = shape.seen_at(0.1, 0.2).expect("in front of it");
        assert!(!shape.shadows(&hit, hit.normal));
        assert!(shape.shadows(&hit, -TO_VIEWER));
    }

    #[test]
    fn nothing_is_no_mesh() {
        assert!(Mesh::new(Vec::new()).is_none());
        assert!(Mesh::new(vec![Triangle::new([DVec3::ONE; 3], None)]).is_none());
    }
}
