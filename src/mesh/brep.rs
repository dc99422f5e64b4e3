//! Boundary representation with exact faces, and its STEP file.
//!
//! Just what parts made of plates and turned features need: planes, cylinders,
//! cones and spheres, bounded by straight and circular edges. Closed bands are
//! held as two halves, so that no face needs a seam.

use std::collections::HashMap;
use std::fmt::Write as _;

use glam::DVec3;

use super::TriMesh;
use super::number::step_real as real;

/// The curve that an edge lies on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Curve {
    /// Straight from end to end.
    Line,
    /// A circle, run along counter-clockwise about `axis` from start to end.
    Circle { center: DVec3, axis: DVec3, radius: f64 },
}

/// The surface that a face lies on; `axis` is a unit vector.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) enum Surface {
    Plane {
        origin: DVec3,
        normal: DVec3,
    },
    Cylinder {
        origin: DVec3,
        axis: DVec3,
        radius: f64,
    },
    /// `radius` at `origin`, growing along `axis`.
    Cone {
        origin: DVec3,
        axis: DVec3,
        radius: f64,
        half_angle: f64,
    },
    Sphere {
        center: DVec3,
        radius: f64,
    },
}

#[derive(Debug, Clone, Copy)]
struct Edge {
    from: usize,
    to: usize,
    curve: Curve,
}

/// An edge and whether it is run along as it is stored.
pub(super) type Turn = (usize, bool);

#[derive(Debug, Clone)]
struct Face {
    surface: Surface,
    /// The material is on the side away from the surface's own normal.
    outward: bool,
    loops: Vec<Vec<Turn>>,
}

/// One closed shell.
#[derive(Debug, Clone, Default)]
pub struct Brep {
    vertices: Vec<DVec3>,
    edges: Vec<Edge>,
    faces: Vec<Face>,
}

impl Brep {
    pub(super) fn vertex(&mut self, point: DVec3) -> usize {
        self.vertices.push(point);
        self.vertices.len() - 1
    }

    pub(super) fn edge(&mut self, from: usize, to: usize, curve: Curve) -> usize {
        self.edges.push(Edge { from, to, curve });
        self.edges.len() - 1
    }

    /// Adds a face. Loops run counter-clockwise seen from outside, the outer
    /// one first; `outward` says whether outside is where the surface's own
    /// normal points.
    pub(super) fn face(&mut self, surface: Surface, outward: bool, loops: Vec<Vec<Turn>>) {
        self.faces.push(Face { surface, outward, loops });
    }

    /// Number of faces.
    pub fn face_count(&self) -> usize {
        self.faces.len()
    }

    /// A solid of flat triangles from a closed mesh.
    pub fn faceted(mesh: &TriMesh) -> Self {
        let mut out = Self { vertices: mesh.vertices_mm.clone(), ..Self::default() };
        let mut edge_of: HashMap<(u32, u32), usize> = HashMap::with_capacity(mesh.triangles.len() * 3 / 2);
        for (triangle, [a, b, c]) in mesh.triangles.iter().zip(mesh.iter_mm()) {
            let Some(normal) = (b - a).cross(c - a).try_normalize() else { continue };
            let turns = [(0, 1), (1, 2), (2, 0)].map(|(i, j)| {
                let (from, to) = (triangle[i], triangle[j]);
                let key = (from.min(to), from.max(to));
                let edge = *edge_of.entry(key).or_insert_with(|| {
                    out.edges.push(Edge { from: from as usize, to: to as usize, curve: Curve::Line });
                    out.edges.len() - 1
                });
                (edge, out.edges[edge].from == from as usize)
            });
            out.face(Surface::Plane { origin: a, normal }, true, vec![turns.to_vec()]);
        }
        out
    }

    /// The solid as a STEP file (AP214, millimetres). The bytes depend on the
    /// solid and the name alone: the header's time is fixed.
    pub fn to_step(&self, name: &str) -> String {
        let mut w = Writer { text: String::new(), next: 1 };
        let points: Vec<usize> = self.vertices.iter().map(|&v| w.point(v)).collect();
        let vertices: Vec<usize> =
            points.iter().map(|p| w.add(format_args!("VERTEX_POINT('',#{p})"))).collect();
        let edges: Vec<usize> = self
            .edges
            .iter()
            .map(|e| {
                let curve = match e.curve {
                    Curve::Line => {
                        let along = (self.vertices[e.to] - self.vertices[e.from]).normalize_or(DVec3::X);
                        let direction = w.direction(along);
                        let vector = w.add(format_args!("VECTOR('',#{direction},1.)"));
                        w.add(format_args!("LINE('',#{},#{vector})", points[e.from]))
                    }
                    Curve::Circle { center, axis, radius } => {
                        let start = self.vertices[e.from] - center;
                        let place = w.placement(center, axis, start.normalize_or(DVec3::X));
                        w.add(format_args!("CIRCLE('',#{place},{})", real(radius)))
                    }
                };
                w.add(format_args!("EDGE_CURVE('',#{},#{},#{curve},.T.)", vertices[e.from], vertices[e.to]))
            })
            .collect();
        let faces: Vec<usize> = self
            .faces
            .iter()
            .map(|face| {
                let bounds: Vec<usize> = face
                    .loops
                    .iter()
                    .enumerate()
                    .map(|(i, turns)| {
                        let oriented: Vec<usize> = turns
                            .iter()
                            .map(|&(edge, forward)| {
                                let sense = flag(forward);
                                w.add(format_args!("ORIENTED_EDGE('',*,*,#{},{sense})", edges[edge]))
                            })
                            .collect();
                        let path = w.add(format_args!("EDGE_LOOP('',({}))", list(&oriented)));
                        let kind = if i == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
                        w.add(format_args!("{kind}('',#{path},.T.)"))
                    })
                    .collect();
                let surface = w.surface(&face.surface);
                let sense = flag(face.outward);
                w.add(format_args!("ADVANCED_FACE('',({}),#{surface},{sense})", list(&bounds)))
            })
            .collect();
        let shell = w.add(format_args!("CLOSED_SHELL('',({}))", list(&faces)));
        let solid = w.add(format_args!("MANIFOLD_SOLID_BREP('{name}',#{shell})"));
        w.product(name, solid)
    }
}

fn flag(yes: bool) -> &'static str {
    if yes { ".T." } else { ".F." }
}

fn list(ids: &[usize]) -> String {
    let mut out = String::new();
    for (i, id) in ids.iter().enumerate() {
        let comma = if i == 0 { "" } else { "," };
        let _ = write!(out, "{comma}#{id}");
    }
    out
}

struct Writer {
    text: String,
    next: usize,
}

impl Writer {
    fn add(&mut self, entity: std::fmt::Arguments<'_>) -> usize {
        let id = self.next;
        self.next += 1;
        // Writing to a String does not fail.
        let _ = writeln!(self.text, "#{id}={entity};");
        id
    }

    fn point(&mut self, p: DVec3) -> usize {
        self.add(format_args!("CARTESIAN_POINT('',({},{},{}))", real(p.x), real(p.y), real(p.z)))
    }

    fn direction(&mut self, d: DVec3) -> usize {
        self.add(format_args!("DIRECTION('',({},{},{}))", real(d.x), real(d.y), real(d.z)))
    }

    fn placement(&mut self, origin: DVec3, axis: DVec3, x: DVec3) -> usize {
        let (o, a, r) = (self.point(origin), self.direction(axis), self.direction(x));
        self.add(format_args!("AXIS2_PLACEMENT_3D('',#{o},#{a},#{r})"))
    }

    fn surface(&mut self, surface: &Surface) -> usize {
        match *surface {
            Surface::Plane { origin, normal } => {
                let place = self.placement(origin, normal, normal.any_orthonormal_vector());
                self.add(format_args!("PLANE('',#{place})"))
            }
            Surface::Cylinder { origin, axis, radius } => {
                let place = self.placement(origin, axis, axis.any_orthonormal_vector());
                self.add(format_args!("CYLINDRICAL_SURFACE('',#{place},{})", real(radius)))
            }
            Surface::Cone { origin, axis, radius, half_angle } => {
                let place = self.placement(origin, axis, axis.any_orthonormal_vector());
                self.add(format_args!("CONICAL_SURFACE('',#{place},{},{})", real(radius), real(half_angle)))
            }
            Surface::Sphere { center, radius } => {
                let place = self.placement(center, DVec3::Z, DVec3::X);
                self.add(format_args!("SPHERICAL_SURFACE('',#{place},{})", real(radius)))
            }
        }
    }

    /// The product round the solid, its units and its header.
    fn product(mut self, name: &str, solid: usize) -> String {
        let context = self.add(format_args!("APPLICATION_CONTEXT('automotive design')"));
        self.add(format_args!(
            "APPLICATION_PROTOCOL_DEFINITION('international standard','automotive_design',2000,#{context})"
        ));
        let product_context = self.add(format_args!("PRODUCT_CONTEXT('',#{context},'mechanical')"));
        let product = self.add(format_args!("PRODUCT('{name}','{name}','',(#{product_context}))"));
        let formation = self.add(format_args!("PRODUCT_DEFINITION_FORMATION('','',#{product})"));
        let design =
            self.add(format_args!("PRODUCT_DEFINITION_CONTEXT('part definition',#{context},'design')"));
        let definition = self.add(format_args!("PRODUCT_DEFINITION('design','',#{formation},#{design})"));
        let shape = self.add(format_args!("PRODUCT_DEFINITION_SHAPE('','',#{definition})"));
        let mm = self.add(format_args!("(LENGTH_UNIT()NAMED_UNIT(*)SI_UNIT(.MILLI.,.METRE.))"));
        let rad = self.add(format_args!("(NAMED_UNIT(*)PLANE_ANGLE_UNIT()SI_UNIT($,.RADIAN.))"));
        let sr = self.add(format_args!("(NAMED_UNIT(*)SI_UNIT($,.STERADIAN.)SOLID_ANGLE_UNIT())"));
        let accuracy = self.add(format_args!(
            "UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE(1.E-6),#{mm},'distance_accuracy_value','')"
        ));
        let space = self.add(format_args!(
            "(GEOMETRIC_REPRESENTATION_CONTEXT(3)GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#{accuracy}))\
             GLOBAL_UNIT_ASSIGNED_CONTEXT((#{mm},#{rad},#{sr}))REPRESENTATION_CONTEXT('',''))"
        ));
        let origin = self.placement(DVec3::ZERO, DVec3::Z, DVec3::X);
        let representation = self
            .add(format_args!("ADVANCED_BREP_SHAPE_REPRESENTATION('{name}',(#{origin},#{solid}),#{space})"));
        self.add(format_args!("SHAPE_DEFINITION_REPRESENTATION(#{shape},#{representation})"));
        format!(
            "ISO-10303-21;\nHEADER;\nFILE_DESCRIPTION((''),'2;1');\n\
             FILE_NAME('{name}.step','2000-01-01T00:00:00',(''),(''),'domecast','domecast','');\n\
             FILE_SCHEMA(('AUTOMOTIVE_DESIGN {{ 1 0 10303 214 1 1 1 1 }}'));\nENDSEC;\nDATA;\n{}ENDSEC;\nEND-ISO-10303-21;\n",
            self.text
        )
    }
}
