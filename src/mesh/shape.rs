//! Exact shapes from which parts are made, before any triangle exists.

use glam::{DAffine3, DVec2, DVec3};

use super::{Chord, Fit, MeshError, Solid};

/// How a profile runs from one point to the next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ProfileEdge {
    /// Straight: a cylinder, cone or flat ring.
    Line,
    /// A circular arc about a point on the axis: part of a sphere. Both ends
    /// must lie on it.
    Arc {
        /// Height of the sphere's centre, mm.
        center_z_mm: f64,
    },
}

/// Outline of a turned body, from bottom to top: `(radius, z)` points with
/// non-decreasing z. Only the two ends may lie on the axis; an end off the
/// axis is closed by a flat disc.
#[derive(Debug, Clone, PartialEq)]
pub struct Profile {
    /// Radius and height of each point, mm.
    pub points_mm: Vec<DVec2>,
    /// Edge from point `i` to point `i + 1`: one less than points.
    pub edges: Vec<ProfileEdge>,
}

impl Profile {
    /// A profile of straight edges through `(radius, z)` points.
    pub fn lines(points_mm: &[(f64, f64)]) -> Self {
        Self {
            points_mm: points_mm.iter().map(|&(r, z)| DVec2::new(r, z)).collect(),
            edges: vec![ProfileEdge::Line; points_mm.len().saturating_sub(1)],
        }
    }

    /// Largest radius, mm.
    pub fn max_radius_mm(&self) -> f64 {
        self.points_mm.iter().fold(0.0, |m, p| m.max(p.x))
    }
}

/// An exact solid, in its own frame.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// A body of revolution about z.
    Turned {
        /// Its outline.
        profile: Profile,
        /// What its circles keep when they become polygons.
        fit: Fit,
    },
    /// A convex polygon with rounded corners, extruded along z.
    Prism {
        /// Corners counter-clockwise, mm.
        outline_mm: Vec<DVec2>,
        /// Radius at every corner, mm; 0 for sharp ones.
        corner_radius_mm: f64,
        /// Lower face, mm.
        bottom_z_mm: f64,
        /// Upper face, mm.
        top_z_mm: f64,
    },
}

impl Shape {
    /// A box between two opposite corners.
    pub fn cuboid(low_mm: DVec3, high_mm: DVec3) -> Self {
        Self::Prism {
            outline_mm: vec![
                DVec2::new(low_mm.x, low_mm.y),
                DVec2::new(high_mm.x, low_mm.y),
                DVec2::new(high_mm.x, high_mm.y),
                DVec2::new(low_mm.x, high_mm.y),
            ],
            corner_radius_mm: 0.0,
            bottom_z_mm: low_mm.z,
            top_z_mm: high_mm.z,
        }
    }

    /// A rectangle about the axis with rounded corners, extruded.
    pub fn rounded_plate(size_mm: DVec2, corner_radius_mm: f64, bottom_z_mm: f64, top_z_mm: f64) -> Self {
        let h = size_mm * 0.5;
        Self::Prism {
            outline_mm: vec![
                DVec2::new(-h.x, -h.y),
                DVec2::new(h.x, -h.y),
                DVec2::new(h.x, h.y),
                DVec2::new(-h.x, h.y),
            ],
            corner_radius_mm,
            bottom_z_mm,
            top_z_mm,
        }
    }

    /// A cylinder about z.
    pub fn cylinder(radius_mm: f64, bottom_z_mm: f64, top_z_mm: f64, fit: Fit) -> Self {
        Self::Turned { profile: Profile::lines(&[(radius_mm, bottom_z_mm), (radius_mm, top_z_mm)]), fit }
    }

    /// Volume of the exact shape, mm^3, in closed form.
    pub fn volume_mm3(&self) -> f64 {
        use std::f64::consts::PI;
        match self {
            Self::Turned { profile, .. } => profile
                .points_mm
                .windows(2)
                .zip(&profile.edges)
                .map(|(ends, edge)| {
                    let (low, high) = (ends[0], ends[1]);
                    let h = high.y - low.y;
                    match *edge {
                        // Frustum of a cone.
                        ProfileEdge::Line => {
                            PI * h / 3.0 * (low.x * low.x + low.x * high.x + high.x * high.x)
                        }
                        // Spherical segment of two bases.
                        ProfileEdge::Arc { .. } => {
                            PI * h / 6.0 * (3.0 * low.x * low.x + 3.0 * high.x * high.x + h * h)
                        }
                    }
                })
                .sum(),
            Self::Prism { outline_mm, corner_radius_mm, bottom_z_mm, top_z_mm } => {
                let n = outline_mm.len();
                let mut area = 0.0;
                for i in 0..n {
                    let (before, here, after) =
                        (outline_mm[(i + n - 1) % n], outline_mm[i], outline_mm[(i + 1) % n]);
                    area += 0.5 * here.perp_dot(after);
                    // A fillet of radius r at a corner that turns by t takes
                    // away r^2 (tan(t/2) - t/2).
                    let turn: f64 = (here - before).angle_to(after - here);
                    area -= corner_radius_mm.powi(2) * ((0.5 * turn).tan() - 0.5 * turn);
                }
                area * (top_z_mm - bottom_z_mm)
            }
        }
    }
}

/// A shape in its place in a part.
#[derive(Debug, Clone, PartialEq)]
pub struct Piece {
    /// What it is, for messages: "magnet pocket 3".
    pub name: String,
    /// The shape in its own frame.
    pub shape: Shape,
    /// Where it sits; rigid.
    pub part_from_shape: DAffine3,
    /// A finer (or coarser) tolerance than the part's.
    pub chord: Option<Chord>,
}

impl Piece {
    /// A shape that needs no moving.
    pub fn new(name: impl Into<String>, shape: Shape) -> Self {
        Self { name: name.into(), shape, part_from_shape: DAffine3::IDENTITY, chord: None }
    }

    /// The same shape somewhere else.
    #[must_use]
    pub fn at(mut self, x_mm: f64, y_mm: f64) -> Self {
        self.part_from_shape = DAffine3::from_translation(DVec3::new(x_mm, y_mm, 0.0));
        self
    }

    /// The same shape in any pose.
    #[must_use]
    pub fn placed(mut self, part_from_shape: DAffine3) -> Self {
        self.part_from_shape = part_from_shape;
        self
    }

    /// The same shape with its own tolerance.
    #[must_use]
    pub fn with_chord(mut self, chord: Chord) -> Self {
        self.chord = Some(chord);
        self
    }

    /// The piece as a solid.
    ///
    /// # Errors
    /// [`MeshError::Dimension`] for a shape that is none.
    pub fn solid(&self, chord: Chord) -> Result<Solid, MeshError> {
        let mesh = self.shape.triangulate(&self.name, self.chord.unwrap_or(chord))?;
        Solid::from_mesh(&mesh.transformed(&self.part_from_shape))
    }
}

/// A part as exact shapes: everything in `added` united, less everything in
/// `cut`.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Construction {
    /// Material.
    pub added: Vec<Piece>,
    /// Tools that take material away.
    pub cut: Vec<Piece>,
}

impl Construction {
    /// Triangulates the pieces and joins them: material united, tools united,
    /// one subtraction.
    ///
    /// # Errors
    /// [`MeshError`]: a shape that is none, a kernel failure, or nothing left.
    pub fn solid(&self, chord: Chord) -> Result<Solid, MeshError> {
        let solids = |pieces: &[Piece]| pieces.iter().map(|p| p.solid(chord)).collect::<Result<Vec<_>, _>>();
        let material = Solid::union(solids(&self.added)?)?;
        if self.cut.is_empty() {
            return Ok(material);
        }
        material.difference(&Solid::union(solids(&self.cut)?)?)
    }
}
