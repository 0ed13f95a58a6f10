//! What stands between two polygons: surfaces as occluders, and the shadows they cast.

use glam::{DVec2, DVec3};

use crate::polygon::{CutPlane, Polygon, Polygons, bounding_sphere, in_front};

/// Corners of a surface at most.
const MOST_CORNERS: usize = 4;

/// Behind all of these planes there is no light.
struct Shadow {
    planes: [CutPlane; MOST_CORNERS + 1],
    count: usize,
}

impl Shadow {
    fn planes(&self) -> &[CutPlane] {
        &self.planes[..self.count]
    }
}

/// A surface that blocks light from either side.
#[derive(Clone, Debug)]
struct Occluder {
    outline: Polygon,
    plane: CutPlane,
    center: DVec3,
    radius: f64,
    /// Axes within the plane, in which `flat` is the outline, counterclockwise.
    axes: [DVec3; 2],
    flat: Vec<DVec2>,
}

/// All the surfaces of a scene that can stand between any two points of it.
#[derive(Clone, Debug)]
pub(crate) struct Occluders {
    occluders: Vec<Occluder>,
    tolerance: f64,
}

/// What is between two polygons that are in front of each other.
#[derive(Clone, Debug)]
pub(crate) enum Between {
    /// Nothing: every point of one sees every point of the other.
    Nothing,
    /// One occluder that hides all from all.
    Everything,
    /// Perhaps something: these occluders reach into the convex hull of the two, or come near it.
    Some(Vec<usize>),
}

impl Occluders {
    /// The occluders among surfaces with these outlines; lengths below `tolerance` [m] count as 0. A surface
    /// that has the whole scene on one side occludes nothing: a convex scene has no occluders.
    pub(crate) fn new(outlines: &[Polygon], tolerance: f64) -> Self {
        Occluders::around(outlines, &[], tolerance)
    }

    /// As [`Occluders::new`], of a scene with these points besides its surfaces.
    pub(crate) fn around(outlines: &[Polygon], points: &[DVec3], tolerance: f64) -> Self {
        let corners: Vec<DVec3> = outlines.iter().flatten().chain(points).copied().collect();
        let occluders = outlines.iter().map(|outline| Occluder::new(outline.clone()));
        let inside = |occluder: &Occluder| {
            let [low, high] = occluder.plane.range(&corners);
            low < -tolerance && high > tolerance
        };
        Occluders { occluders: occluders.filter(inside).collect(), tolerance }
    }

    /// What is between two convex polygons `p` and `q`. An occluder in none of whose points a line from one to
    /// the other may meet it is left out.
    pub(crate) fn between(&self, p: &[DVec3], q: &[DVec3]) -> Between {
        let ((from, r_p), (to, r_q)) = (bounding_sphere(p), bounding_sphere(q));
        let hull: Polygon = p.iter().chain(q).copied().collect();
        let mut candidates = vec![];
        for (number, occluder) in self.occluders.iter().enumerate() {
            let reach = occluder.radius + r_p.max(r_q);
            let aside = distance_squared_to_segment(occluder.center, from, to);
            if aside > reach * reach {
                continue;
            }
            let Some(section) = occluder.section(&hull, self.tolerance) else { continue };
            if occluder.hides(p, q, &section, self.tolerance) {
                return Between::Everything;
            }
            if occluder.meets(section, self.tolerance) {
                candidates.push((aside / (occluder.radius * occluder.radius), number));
            }
        }
        if candidates.is_empty() {
            return Between::Nothing;
        }
        // Those that hide most come first, so that what is dark is soon seen to be.
        candidates.sort_by(|a, b| a.0.total_cmp(&b.0));
        Between::Some(candidates.into_iter().map(|(_, number)| number).collect())
    }

    /// A polygon cut along the planes of those occluders that touch it: what its points see jumps there.
    pub(crate) fn cut(&self, polygon: &[DVec3], occluders: &[usize]) -> Vec<Polygon> {
        let touches = |occluder: &&Occluder| {
            let section = occluder.section(polygon, self.tolerance);
            section.is_some_and(|section| occluder.meets(section, -self.tolerance))
        };
        let mut parts = vec![polygon.to_vec()];
        for occluder in occluders.iter().map(|&number| &self.occluders[number]).filter(touches) {
            let halves = |part: Polygon| {
                [occluder.plane, occluder.plane.flipped()].map(|side| in_front(&part, &side, self.tolerance))
            };
            parts = parts.into_iter().flat_map(halves).filter(|half| !half.is_empty()).collect();
        }
        parts
    }

    /// The numbers of all occluders.
    pub(crate) fn all(&self) -> Vec<usize> {
        (0..self.occluders.len()).collect()
    }

    /// Puts the parts of a polygon that a point sees past some occluders into `visible`.
    pub(crate) fn see(&self, point: DVec3, polygon: &[DVec3], occluders: &[usize], visible: &mut Polygons) {
        visible.begin(polygon);
        for &number in occluders {
            let occluder = &self.occluders[number];
            let Some(towards) = occluder.towards(point, self.tolerance) else { continue };
            if visible.iter().all(|part| towards.is_all_in_front(part, self.tolerance)) {
                // All of it is on this side of the occluder.
                continue;
            }
            visible.take_away(occluder.shadow(point, towards).planes(), self.tolerance);
            if visible.is_empty() {
                break;
            }
        }
    }
}

impl Occluder {
    fn new(outline: Polygon) -> Self {
        let (u, v) = (outline[1] - outline[0], outline[outline.len() - 1] - outline[0]);
        let plane = CutPlane::through(outline[0], u.cross(v));
        let along = u.normalize();
        let axes = [along, plane.normal.cross(along)];
        let (center, radius) = bounding_sphere(&outline);
        let flat = outline.iter().map(|&corner| flatten(axes, corner)).collect();
        Occluder { outline, plane, center, radius, axes, flat }
    }

    /// Where the plane cuts the convex hull of some points, as points whose hull is the cut; `None` if they
    /// are all on one side.
    fn section(&self, hull: &[DVec3], tolerance: f64) -> Option<Vec<DVec2>> {
        let [low, high] = self.plane.range(hull);
        if low >= -tolerance || high <= tolerance {
            return None;
        }
        let height = |&point: &DVec3| (point, self.plane.height(point));
        let heights: Vec<(DVec3, f64)> = hull.iter().map(height).collect();
        let above = || heights.iter().filter(|(_, h)| *h > tolerance);
        let below = || heights.iter().filter(|(_, h)| *h < -tolerance);
        let on = heights.iter().filter(|(_, h)| h.abs() <= tolerance).map(|(point, _)| *point);
        let crossings = above().flat_map(|a| below().map(move |b| a.0 + (b.0 - a.0) * (a.1 / (a.1 - b.1))));
        let section = on.chain(crossings).map(|point| flatten(self.axes, point)).collect();
        Some(section)
    }

    /// Whether it separates two polygons altogether: they lie on either side, and all lines between them,
    /// whose points on the plane are in the hull of the section, meet it.
    fn hides(&self, p: &[DVec3], q: &[DVec3], section: &[DVec2], tolerance: f64) -> bool {
        let ([p_low, p_high], [q_low, q_high]) = (self.plane.range(p), self.plane.range(q));
        let apart = p_low.min(-q_high) >= -tolerance || q_low.min(-p_high) >= -tolerance;
        apart && edges(&self.flat).all(|[a, b]| section.iter().all(|&s| beside(a, b, s) >= -tolerance))
    }

    /// Whether the hull of a section and the outline share more than `tolerance` [m]; if that is negative,
    /// touching will do.
    fn meets(&self, section: Vec<DVec2>, tolerance: f64) -> bool {
        let section = convex_hull(section);
        !separates(&self.flat, &section, tolerance) && !separates(&section, &self.flat, tolerance)
    }

    /// The plane, with `point` in front; `None` where the point is in the plane itself.
    fn towards(&self, point: DVec3, tolerance: f64) -> Option<CutPlane> {
        let height = self.plane.height(point);
        (height.abs() > tolerance).then(|| if height > 0.0 { self.plane } else { self.plane.flipped() })
    }

    /// The shadow of a light at `point`, which is in front of the plane `towards`.
    fn shadow(&self, point: DVec3, towards: CutPlane) -> Shadow {
        // Counterclockwise seen from the light, the shadow is on the left of every edge.
        let sign = towards.normal.dot(self.plane.normal).signum();
        let mut planes = [towards; MOST_CORNERS + 1];
        for (k, &from) in self.outline.iter().enumerate() {
            let to = self.outline[(k + 1) % self.outline.len()];
            let inwards = (to - from).cross(from - point) * sign;
            planes[k + 1] = CutPlane::through(point, -inwards);
        }
        Shadow { planes, count: self.outline.len() + 1 }
    }
}

fn flatten([u, v]: [DVec3; 2], point: DVec3) -> DVec2 {
    DVec2::new(u.dot(point), v.dot(point))
}

fn distance_squared_to_segment(point: DVec3, from: DVec3, to: DVec3) -> f64 {
    let (span, offset) = (to - from, point - from);
    let along = (offset.dot(span) / span.length_squared()).clamp(0.0, 1.0);
    (offset - span * along).length_squared()
}

fn edges(polygon: &[DVec2]) -> impl Iterator<Item = [DVec2; 2]> {
    polygon.iter().enumerate().map(|(k, &a)| [a, polygon[(k + 1) % polygon.len()]])
}

/// How far a point is to the left of the line from a to b.
fn beside(a: DVec2, b: DVec2, point: DVec2) -> f64 {
    (b - a).normalize_or_zero().perp_dot(point - a)
}

/// Whether an edge of a counterclockwise polygon has all of another polygon on its outer side.
fn separates(polygon: &[DVec2], other: &[DVec2], tolerance: f64) -> bool {
    edges(polygon).any(|[a, b]| a != b && other.iter().all(|&point| beside(a, b, point) <= tolerance))
}

/// The corners of the hull of some points, counterclockwise (Andrew 1979).
fn convex_hull(mut points: Vec<DVec2>) -> Vec<DVec2> {
    points.sort_by(|a, b| a.x.total_cmp(&b.x).then(a.y.total_cmp(&b.y)));
    let half = |points: &mut dyn Iterator<Item = &DVec2>| {
        let mut chain: Vec<DVec2> = vec![];
        for &point in points {
            while let [.., a, b] = chain[..]
                && (b - a).perp_dot(point - b) <= 0.0
            {
                chain.pop();
            }
            chain.push(point);
        }
        chain.pop();
        chain
    };
    let mut hull = half(&mut points.iter());
    hull.extend(half(&mut points.iter().rev()));
    hull
}
