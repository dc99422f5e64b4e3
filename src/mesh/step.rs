//! Solids of truck as STEP files (AP214, millimetres).
//!
//! truck holds a cylinder as a line that is revolved, a circle as a spline. Here they become what they are: planes,
//! cylinders, cones and spheres, bounded by lines and circles, which every CAD program knows by name. The bytes
//! depend on the solid and the name alone: the header's time is fixed.

use std::collections::HashMap;
use std::fmt::{self, Write as _};

use truck_modeling::{
    BoundedCurve, Curve, Edge, EdgeID, EuclideanSpace, Face, InnerSpace, MetricSpace, ParametricCurve,
    Point3, Processor, RevolutedCurve, Surface, Transform, Transformed, Vector3, Vertex, VertexID, Zero,
};

use crate::number::{rounded, step_real};

/// A solid with a curve or a surface that is none of those that this writer knows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StepError {
    /// What it is.
    pub what: &'static str,
}

impl fmt::Display for StepError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "STEP: the solid has {}", self.what)
    }
}

impl std::error::Error for StepError {}

/// How far a spline may be from a circle, of its radius, and a length from zero, mm: rounding, and nothing else.
const ROUNDING: f64 = 1e-9;

/// Digits after the point of lengths in mm and of directions: what truck's rounding leaves sound.
const PLACES: i32 = 12;

/// The solid as a STEP file. Curves must be lines and arcs of circles; surfaces planes, and lines and arcs that are
/// revolved about an axis in their plane.
///
/// ```
/// use domecast_mesh::{TriMesh, write_step};
/// use glam::DVec3;
/// let corners = [DVec3::ZERO, DVec3::X, DVec3::Y, DVec3::Z];
/// let triangles = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [2, 0, 3]];
/// let mesh = TriMesh { vertices_mm: corners.to_vec(), triangles: triangles.to_vec() };
/// let text = write_step(&mesh.faceted_solid(), "tetrahedron")?;
/// assert_eq!(text.matches("=ADVANCED_FACE(").count(), 4);
/// # Ok::<(), domecast_mesh::StepError>(())
/// ```
///
/// # Errors
/// [`StepError`] for another curve or surface.
pub fn write_step(solid: &truck_modeling::Solid, name: &str) -> Result<String, StepError> {
    let mut w = Writer::default();
    let mut shells = Vec::new();
    for shell in solid.boundaries() {
        let faces = shell.iter().map(|face| w.face(face)).collect::<Result<Vec<_>, _>>()?;
        shells.push(w.add(format_args!("CLOSED_SHELL('',({}))", list(&faces))));
    }
    let (outer, voids) = shells.split_first().ok_or(StepError { what: "no faces" })?;
    let name = escaped(name);
    let body = if voids.is_empty() {
        w.add(format_args!("MANIFOLD_SOLID_BREP('{name}',#{outer})"))
    } else {
        let voids: Vec<usize> = voids
            .iter()
            .map(|shell| w.add(format_args!("ORIENTED_CLOSED_SHELL('',*,#{shell},.T.)")))
            .collect();
        w.add(format_args!("BREP_WITH_VOIDS('{name}',#{outer},({}))", list(&voids)))
    };
    Ok(w.product(&name, body))
}

/// The circle that an arc lies on, run along counter-clockwise about its axis.
pub(crate) struct Circle {
    pub(crate) center: Point3,
    pub(crate) axis: Vector3,
    pub(crate) radius: f64,
}

impl Circle {
    /// `None` if the curve is no arc of a circle.
    pub(crate) fn of(curve: &Curve) -> Option<Self> {
        let (start, end) = curve.range_tuple();
        let at = |share: f64| curve.subs(start + share * (end - start));
        let (first, middle, last) = (at(0.0), at(0.5), at(1.0));
        let (u, v) = (middle - first, last - first);
        let normal = u.cross(v);
        let square = normal.magnitude2();
        let center =
            first + (normal.cross(u) * v.magnitude2() + v.cross(normal) * u.magnitude2()) / (2.0 * square);
        let radius = center.distance(first);
        let is_circle = [0.2, 0.4, 0.6, 0.8]
            .iter()
            .all(|share| (center.distance(at(*share)) - radius).abs() <= ROUNDING * radius);
        is_circle.then(|| Self { center, axis: normal.normalize(), radius })
    }
}

/// A surface by its name in STEP, and whether truck's normal points where STEP's does.
struct Elementary {
    kind: &'static str,
    origin: Point3,
    axis: Vector3,
    /// Radius and half angle, as far as the kind has them.
    sizes: Vec<f64>,
    agrees: bool,
}

impl Elementary {
    fn of(surface: &Surface) -> Result<Self, StepError> {
        match surface {
            Surface::Plane(plane) => Ok(Self::plane(plane.origin(), plane.normal())),
            Surface::RevolutedCurve(revolved) => Self::revolved(revolved)
                .ok_or(StepError { what: "a revolved surface that is not elementary" }),
            _ => Err(StepError { what: "a spline surface" }),
        }
    }

    fn plane(origin: Point3, axis: Vector3) -> Self {
        Self { kind: "PLANE", origin, axis, sizes: Vec::new(), agrees: true }
    }

    fn revolved(revolved: &Processor<RevolutedCurve<Curve>, truck_modeling::Matrix4>) -> Option<Self> {
        let map = *revolved.transform();
        let curve = revolved.entity().entity_curve().transformed(map);
        let foot = map.transform_point(revolved.entity().origin());
        let axis = map.transform_vector(revolved.entity().axis()).normalize();
        let height = |p: Point3| (p - foot).dot(axis);
        let radial = |p: Point3| (p - foot) - axis * height(p);
        let (start, end) = curve.range_tuple();
        let middle = 0.5 * (start + end);
        let here = curve.subs(middle);
        // truck's normal: along the curve, then along the turn.
        let turn = if revolved.orientation() { axis } else { -axis };
        let normal = curve.der(middle).cross(turn.cross(radial(here)));
        let Curve::Line(line) = &curve else {
            let Circle { center, radius, .. } = Circle::of(&curve)?;
            let is_on_axis = radial(center).magnitude() <= ROUNDING * radius;
            let agrees = normal.dot(here - center) > 0.0;
            let sphere =
                Self { kind: "SPHERICAL_SURFACE", origin: center, axis, sizes: vec![radius], agrees };
            return is_on_axis.then_some(sphere);
        };
        let agrees = normal.dot(radial(here)) > 0.0;
        let (rise, growth) =
            (height(line.1) - height(line.0), radial(line.1).magnitude() - radial(line.0).magnitude());
        // A line askew to the axis would make a hyperboloid.
        let plane_of_axis = axis.cross(radial(here));
        if plane_of_axis.dot(line.1 - line.0).abs() > ROUNDING * plane_of_axis.magnitude() {
            return None;
        }
        let foot_at = |p: Point3| foot + axis * height(p);
        if rise.abs() <= ROUNDING {
            return Some(Self::plane(foot_at(line.0), normal.normalize()));
        }
        let radius = radial(line.0).magnitude();
        if growth.abs() <= ROUNDING {
            let sizes = vec![radius];
            return Some(Self { kind: "CYLINDRICAL_SURFACE", origin: foot_at(line.0), axis, sizes, agrees });
        }
        // It grows along its axis, from the end that is off the axis or the narrow one.
        let axis = if (growth > 0.0) == (rise > 0.0) { axis } else { -axis };
        let wide = if growth > 0.0 { line.1 } else { line.0 };
        let sizes = vec![radial(wide).magnitude(), (growth / rise).abs().atan()];
        Some(Self { kind: "CONICAL_SURFACE", origin: foot_at(wide), axis, sizes, agrees })
    }
}

#[derive(Default)]
struct Writer {
    text: String,
    count: usize,
    vertices: HashMap<VertexID, usize>,
    edges: HashMap<EdgeID, usize>,
}

impl Writer {
    fn add(&mut self, entity: fmt::Arguments<'_>) -> usize {
        self.count += 1;
        // Writing to a String does not fail.
        let _ = writeln!(self.text, "#{}={entity};", self.count);
        self.count
    }

    fn point(&mut self, p: Point3) -> usize {
        self.add(format_args!("CARTESIAN_POINT('',({},{},{}))", real(p.x), real(p.y), real(p.z)))
    }

    fn direction(&mut self, d: Vector3) -> usize {
        self.add(format_args!("DIRECTION('',({},{},{}))", real(d.x), real(d.y), real(d.z)))
    }

    fn placement(&mut self, origin: Point3, axis: Vector3, x: Vector3) -> usize {
        let (o, a, r) = (self.point(origin), self.direction(axis), self.direction(x));
        self.add(format_args!("AXIS2_PLACEMENT_3D('',#{o},#{a},#{r})"))
    }

    fn vertex(&mut self, vertex: &Vertex) -> usize {
        if let Some(id) = self.vertices.get(&vertex.id()) {
            return *id;
        }
        let at = self.point(vertex.point());
        let id = self.add(format_args!("VERTEX_POINT('',#{at})"));
        self.vertices.insert(vertex.id(), id);
        id
    }

    /// The edge in its own direction, whichever way it is run along here.
    fn edge(&mut self, edge: &Edge) -> Result<usize, StepError> {
        if let Some(id) = self.edges.get(&edge.id()) {
            return Ok(*id);
        }
        let (front, back) = (edge.absolute_front(), edge.absolute_back());
        let (from, to) = (self.vertex(front), self.vertex(back));
        let (start, end) = (front.point(), back.point());
        let curve = match edge.curve() {
            Curve::Line(_) => {
                let (point, along) = (self.point(start), self.direction((end - start).normalize()));
                let vector = self.add(format_args!("VECTOR('',#{along},1.)"));
                self.add(format_args!("LINE('',#{point},#{vector})"))
            }
            curve => {
                let circle =
                    Circle::of(&curve).ok_or(StepError { what: "an edge that is no line and no arc" })?;
                let x = (start - circle.center).normalize();
                let place = self.placement(circle.center, circle.axis, x);
                self.add(format_args!("CIRCLE('',#{place},{})", real(circle.radius)))
            }
        };
        let id = self.add(format_args!("EDGE_CURVE('',#{from},#{to},#{curve},.T.)"));
        self.edges.insert(edge.id(), id);
        Ok(id)
    }

    fn face(&mut self, face: &Face) -> Result<usize, StepError> {
        let mut bounds = Vec::new();
        for (i, wire) in face.boundaries().iter().enumerate() {
            let mut oriented = Vec::with_capacity(wire.len());
            for edge in wire {
                let id = self.edge(edge)?;
                let sense = flag(edge.orientation());
                oriented.push(self.add(format_args!("ORIENTED_EDGE('',*,*,#{id},{sense})")));
            }
            let path = self.add(format_args!("EDGE_LOOP('',({}))", list(&oriented)));
            let kind = if i == 0 { "FACE_OUTER_BOUND" } else { "FACE_BOUND" };
            bounds.push(self.add(format_args!("{kind}('',#{path},.T.)")));
        }
        let Elementary { kind, origin, axis, sizes, agrees } = Elementary::of(&face.surface())?;
        let place = self.placement(origin, axis, across(axis));
        let sizes: String = sizes.iter().map(|size| format!(",{}", real(*size))).collect();
        let surface = self.add(format_args!("{kind}('',#{place}{sizes})"));
        let sense = flag(face.orientation() == agrees);
        Ok(self.add(format_args!("ADVANCED_FACE('',({}),#{surface},{sense})", list(&bounds))))
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
        let origin = self.placement(Point3::origin(), Vector3::unit_z(), Vector3::unit_x());
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

fn real(x: f64) -> String {
    step_real(rounded(x, PLACES).parse().unwrap_or(x))
}

fn flag(yes: bool) -> &'static str {
    if yes { ".T." } else { ".F." }
}

fn list(ids: &[usize]) -> String {
    let parts: Vec<String> = ids.iter().map(|id| format!("#{id}")).collect();
    parts.join(",")
}

/// A unit vector across another.
fn across(axis: Vector3) -> Vector3 {
    let other = if axis.x.abs() < 0.9 { Vector3::unit_x() } else { Vector3::unit_y() };
    let off = other - axis * axis.dot(other);
    if off.is_zero() { other } else { off.normalize() }
}

/// Text as the exchange structure holds it: quotes doubled, what is not ASCII by its number.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for unit in text.encode_utf16() {
        match u8::try_from(unit) {
            Ok(b'\'') => out.push_str("''"),
            Ok(b'\\') => out.push_str("\\\\"),
            Ok(byte @ b' '..=b'~') => out.push(char::from(byte)),
            _ => {
                let _ = write!(out, "\\X2\\{unit:04X}\\X0\\");
            }
        }
    }
    out
}
