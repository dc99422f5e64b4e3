//! The sensor put together: printed parts and stand-ins for everything else.

use glam::{DAffine3, DVec3};

use super::measures::Measures;
use super::{Part, PartError, purchased};
use crate::spec::sections::LedColor;
use domecast_mesh::{Chord, MeshError, Piece, Solid, TriMesh};
use domecast_optics::numeric::Rigid;

/// Which body an item belongs to.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Body {
    /// Fixed to the lower platform; in the rest frame.
    Fixed,
    /// Moves with the upper platform; in the sensor frame.
    Moving,
    /// A spring between the two; remade for every pose.
    Spring,
}

/// One thing in the assembly.
#[derive(Debug, Clone)]
pub struct AssemblyItem {
    /// Name: that of the part, or of the stand-in.
    pub name: String,
    /// Red, green, blue, opacity, 0 to 1.
    pub color: [f32; 4],
    /// What it moves with.
    pub body: Body,
    /// Its mesh at rest, mm, sensor frame.
    pub mesh: TriMesh,
    /// Where it goes in the exploded view, mm.
    pub explode_mm: DVec3,
}

/// Everything, closed.
#[derive(Debug, Clone)]
pub struct Assembly {
    /// The items, in a fixed order.
    pub items: Vec<AssemblyItem>,
}

const CLEAR: [f32; 4] = [0.80, 0.87, 0.92, 0.85];
const STEEL: [f32; 4] = [0.62, 0.64, 0.68, 1.0];

impl Assembly {
    /// Puts the sensor together from its printed parts and stand-ins.
    ///
    /// # Errors
    /// [`PartError::Mesh`] if a stand-in cannot be made.
    pub fn of(m: &Measures, parts: &[Part]) -> Result<Self, PartError> {
        let mut a = Self { items: Vec::new() };
        let lift = m.outer_mm.max_element();
        for (name, color, body, up) in [
            ("lower_platform", CLEAR, Body::Fixed, -0.9),
            ("upper_platform", CLEAR, Body::Moving, 0.5),
            ("acrylic_sheet", [0.75, 0.90, 0.95, 0.45], Body::Moving, 1.0),
        ] {
            if let Some(part) = parts.iter().find(|p| p.name == name) {
                a.push(name, color, body, part.mesh.clone(), up * lift);
            }
        }
        let piece = |piece: &Piece| placed_mesh(m, piece);
        let camera = purchased::camera_mesh(m)
            .map_err(|error| PartError::Mesh { part: "camera".to_owned(), error })?;
        a.push("camera", [0.12, 0.12, 0.13, 1.0], Body::Fixed, camera, -0.35 * lift);
        a.push("dome", [0.93, 0.93, 0.90, 0.55], Body::Moving, piece(&purchased::dome(m))?, 1.4 * lift);
        for i in 0..m.spring_axes_mm.len() {
            let [upper, lower] = purchased::magnets(m, i);
            a.push(&upper.name, STEEL, Body::Moving, piece(&upper)?, 0.25 * lift);
            a.push(&lower.name, STEEL, Body::Fixed, piece(&lower)?, -0.5 * lift);
            let coarse = Chord::new(m.chord.tolerance_mm().max(0.1 * m.spring_wire_mm));
            let wire = coarse.and_then(|chord| purchased::spring_wire(m, i, &Rigid::identity(), chord));
            let wire = wire.map_err(|error| PartError::Mesh { part: format!("spring {i}"), error })?;
            a.push(&format!("spring {i}"), STEEL, Body::Spring, wire, -0.1 * lift);
        }
        for (i, led) in m.leds.list.iter().enumerate() {
            let [package, board] = purchased::led(m, i);
            let color = match led.color {
                LedColor::Red => [0.90, 0.15, 0.12, 1.0],
                LedColor::Green => [0.15, 0.75, 0.25, 1.0],
                LedColor::Blue => [0.15, 0.30, 0.95, 1.0],
                LedColor::White => [0.97, 0.97, 0.92, 1.0],
            };
            a.push(&package.name, color, Body::Moving, piece(&package)?, 0.75 * lift);
            a.push(&board.name, [0.10, 0.35, 0.18, 1.0], Body::Moving, piece(&board)?, 0.75 * lift);
        }
        Ok(a)
    }

    fn push(&mut self, name: &str, color: [f32; 4], body: Body, mesh: TriMesh, up_mm: f64) {
        self.items.push(AssemblyItem {
            name: name.to_owned(),
            color,
            body,
            mesh,
            explode_mm: DVec3::Z * up_mm,
        });
    }
}

/// A purchased piece where it sits.
pub(super) fn placed_mesh(m: &Measures, piece: &Piece) -> Result<TriMesh, PartError> {
    let mesh = piece.shape.triangulate(&piece.name, m.chord);
    mesh.map(|mesh| mesh.transformed(&piece.part_from_shape))
        .map_err(|error| PartError::Mesh { part: piece.name.clone(), error })
}

impl AssemblyItem {
    /// The item as a solid at rest; springs as the tubes that they fill.
    ///
    /// # Errors
    /// [`MeshError`] if its mesh is not one.
    pub(super) fn solid(&self) -> Result<Solid, MeshError> {
        Solid::from_mesh(&self.mesh)
    }
}

/// A rigid pose as an affine map.
pub(super) fn affine(pose: &Rigid) -> DAffine3 {
    DAffine3 { matrix3: pose.rotation, translation: pose.translation_mm }
}
