//! Brushes to BSP tree: every side of every brush splits the space it lies in, so that each
//! leaf is either wholly inside or wholly outside of each brush.

use crate::math::{Bounds, Plane, PlaneSet, Vec3};
use crate::texture::Contents;
use crate::winding::{ON_EPS, Winding};

/// One side of a compiled brush.
#[derive(Debug, Clone)]
pub(crate) struct Side {
    /// Index in the plane set; the plane faces out of the brush.
    pub(crate) plane: usize,
    /// Index in the texinfo table of the compilation.
    pub(crate) texinfo: usize,
    /// The side's polygon; `None` for the bevels of expanded brushes.
    pub(crate) winding: Option<Winding>,
    /// Did a first pass find a visible face here? Such sides split first.
    pub(crate) visible: bool,
    /// Faces here are left out (`skip`).
    pub(crate) nodraw: bool,
}

/// A convex brush with its polygons.
#[derive(Debug, Clone)]
pub(crate) struct CompiledBrush {
    pub(crate) sides: Vec<Side>,
    pub(crate) contents: Contents,
    pub(crate) bounds: Bounds,
    /// Splits space only after all others, and does not count for visibility.
    pub(crate) detail: bool,
}

/// The sides' polygons on their planes, each clipped by all others; `None` where nothing is
/// left of a side.
pub(crate) fn brush_windings(planes: &PlaneSet, sides: &[usize]) -> Vec<Option<Winding>> {
    let clip = |&side: &usize| {
        let mut w = Some(Winding::on_plane(&planes.get(side)));
        for &other in sides {
            if other != side {
                w = w.and_then(|w| w.clip_back(&planes.get(other), 1e-6, false));
            }
        }
        w.filter(|w| w.area() > 1e-4)
    };
    sides.iter().map(clip).collect()
}

/// A node or a leaf of the tree while it is compiled.
#[derive(Debug)]
pub(crate) struct Node {
    /// Even plane index and children (front, back); `None` for a leaf.
    pub(crate) split: Option<Split>,
    /// Of a leaf.
    pub(crate) contents: Contents,
    /// Of a leaf: the brushes that fill it.
    pub(crate) brushes: Vec<usize>,
    /// Set by portal building.
    pub(crate) bounds: Bounds,
    /// A point inside, set by portal building.
    pub(crate) middle: Vec3,
    /// Indices of the portals around it, set by portal building.
    pub(crate) portals: Vec<usize>,
}

#[derive(Debug, Clone, Copy)]
pub(crate) struct Split {
    pub(crate) plane: usize,
    pub(crate) children: [usize; 2],
}

impl Node {
    pub(crate) fn leaf(contents: Contents) -> Self {
        Self {
            split: None,
            contents,
            brushes: Vec::new(),
            bounds: Bounds::EMPTY,
            middle: [0.0; 3],
            portals: Vec::new(),
        }
    }
}

/// A BSP tree; node 0 is the root.
#[derive(Debug)]
pub(crate) struct Tree {
    pub(crate) nodes: Vec<Node>,
    /// Of all brushes.
    pub(crate) bounds: Bounds,
}

impl Tree {
    /// The leaf a point is in; points on a plane count as in front.
    pub(crate) fn leaf_at(&self, planes: &PlaneSet, p: Vec3) -> usize {
        let mut node = 0;
        while let Some(split) = self.nodes[node].split {
            let back = planes.get(split.plane).distance(p) < 0.0;
            node = split.children[usize::from(back)];
        }
        node
    }
}

/// The part of a brush inside one cell of the growing tree.
#[derive(Debug, Clone)]
struct Fragment {
    brush: usize,
    bounds: Bounds,
    sides: Vec<FragmentSide>,
}

#[derive(Debug, Clone)]
struct FragmentSide {
    plane: usize,
    winding: Winding,
    visible: bool,
    /// The side lies on a plane that split an ancestor already.
    on_node: bool,
}

impl Fragment {
    fn new(brush: usize, sides: Vec<FragmentSide>) -> Self {
        let bounds = Bounds::of(sides.iter().flat_map(|s| &s.winding.0));
        Self {
            brush,
            bounds,
            sides,
        }
    }

    /// Largest and smallest signed distance from the plane.
    fn extent(&self, plane: &Plane) -> (f64, f64) {
        if let Some(axis) = plane.axis() {
            let (lo, hi) = (self.bounds.mins[axis], self.bounds.maxs[axis]);
            return if plane.normal[axis] > 0.0 {
                (hi - plane.dist, lo - plane.dist)
            } else {
                (-lo - plane.dist, -hi - plane.dist)
            };
        }
        self.sides
            .iter()
            .fold((f64::NEG_INFINITY, f64::INFINITY), |(hi, lo), s| {
                let (h, l) = s.winding.extent(plane);
                (hi.max(h), lo.min(l))
            })
    }

    fn has_plane(&self, pair: usize) -> bool {
        self.sides.iter().any(|s| s.plane & !1 == pair)
    }

    /// Splits by the (even) plane into the parts in front and behind.
    fn split(self, planes: &PlaneSet, plane_index: usize) -> (Option<Self>, Option<Self>) {
        let plane = planes.get(plane_index);
        let (hi, lo) = self.extent(&plane);
        if hi <= ON_EPS && hi <= -lo {
            return (None, Some(self.marked(plane_index)));
        }
        if lo >= -ON_EPS {
            return (Some(self.marked(plane_index)), None);
        }
        // The cut's own polygon: what of the plane lies inside the fragment.
        let mut cut = Some(Winding::on_plane(&plane));
        for s in &self.sides {
            cut = cut.and_then(|w| w.clip_back(&planes.get(s.plane), 1e-6, false));
        }
        let Some(cut) = cut.filter(|w| w.area() > 1e-6) else {
            // Barely touched: it belongs to the side where most of it is.
            return if hi > -lo {
                (Some(self), None)
            } else {
                (None, Some(self))
            };
        };
        let (mut front, mut back) = (Vec::new(), Vec::new());
        for s in self.sides {
            let (f, b) = s.winding.split(&plane, 1e-6);
            let with = |w| FragmentSide {
                winding: w,
                ..s.clone()
            };
            front.extend(f.map(with));
            back.extend(b.map(with));
        }
        // The front part ends at the plane, facing back, and the other way round.
        let side = |plane, winding| FragmentSide {
            plane,
            winding,
            visible: false,
            on_node: true,
        };
        back.push(side(plane_index, cut.clone()));
        front.push(side(plane_index ^ 1, cut.reversed()));
        let wrap = |v: Vec<FragmentSide>| (v.len() >= 4).then(|| Self::new(self.brush, v));
        (wrap(front), wrap(back))
    }

    fn marked(mut self, pair: usize) -> Self {
        for s in &mut self.sides {
            s.on_node |= s.plane & !1 == pair;
        }
        self
    }

    fn fills_its_cell(&self) -> bool {
        self.sides.iter().all(|s| s.on_node)
    }
}

/// Builds the tree of a set of brushes. With `keep_textures` solids that overlap keep splitting
/// each other, so that each face can take the texture of the last brush there; without (clip
/// hulls) the first solid found ends a branch.
pub(crate) fn build(planes: &PlaneSet, brushes: &[CompiledBrush], keep_textures: bool) -> Tree {
    let mut bounds = Bounds::EMPTY;
    let mut fragments = Vec::new();
    for (i, brush) in brushes.iter().enumerate() {
        let sides: Vec<_> = brush
            .sides
            .iter()
            .filter_map(|s| {
                Some(FragmentSide {
                    plane: s.plane,
                    winding: s.winding.clone()?,
                    visible: s.visible,
                    on_node: false,
                })
            })
            .collect();
        bounds.merge(&brush.bounds);
        fragments.push(Fragment::new(i, sides));
    }
    let mut builder = Builder {
        planes,
        brushes,
        keep_textures,
        nodes: Vec::new(),
    };
    builder.nodes.push(Node::leaf(Contents::Empty));
    // A list of cells still to do instead of recursion: deep maps cannot overflow the stack.
    let mut cells = vec![(0, fragments)];
    while let Some((node, fragments)) = cells.pop() {
        let (front, back) = match builder.split_cell(node, fragments) {
            Some(halves) => halves,
            None => continue,
        };
        if let Some(split) = builder.nodes[node].split {
            cells.push((split.children[1], back));
            cells.push((split.children[0], front));
        }
    }
    Tree {
        nodes: builder.nodes,
        bounds,
    }
}

struct Builder<'a> {
    planes: &'a PlaneSet,
    brushes: &'a [CompiledBrush],
    keep_textures: bool,
    nodes: Vec<Node>,
}

impl Builder<'_> {
    fn contents(&self, fragment: &Fragment) -> Contents {
        self.brushes[fragment.brush].contents
    }

    /// Turns a cell into a leaf (`None`), or into a node and returns what lies in its halves.
    fn split_cell(
        &mut self,
        node: usize,
        fragments: Vec<Fragment>,
    ) -> Option<(Vec<Fragment>, Vec<Fragment>)> {
        let (filling, mut rest): (Vec<_>, Vec<_>) =
            fragments.into_iter().partition(Fragment::fills_its_cell);
        let strongest = filling.iter().map(|f| (self.contents(f), f.brush)).max();
        if let Some((contents, brush)) = strongest {
            let keep_textures = self.keep_textures;
            rest.retain(|f| {
                let c = self.brushes[f.brush].contents;
                c > contents || (keep_textures && c == contents && f.brush > brush)
            });
        }
        let Some(plane) = self.choose_plane(&rest) else {
            let leaf = &mut self.nodes[node];
            leaf.contents = strongest.map_or(Contents::Empty, |s| s.0);
            leaf.brushes = filling.iter().map(|f| f.brush).collect();
            return None;
        };
        let (mut front, mut back) = (filling.clone(), filling);
        for f in rest {
            let (a, b) = f.split(self.planes, plane);
            front.extend(a);
            back.extend(b);
        }
        let children = [self.nodes.len(), self.nodes.len() + 1];
        self.nodes.push(Node::leaf(Contents::Empty));
        self.nodes.push(Node::leaf(Contents::Empty));
        self.nodes[node].split = Some(Split { plane, children });
        Some((front, back))
    }

    /// The best plane to split a cell by: details last, visible sides first, few cuts, many
    /// sides on it, both halves alike, axial. While other brushes are left, details have no say,
    /// so that the upper part of the tree is the one they would give alone.
    fn choose_plane(&self, fragments: &[Fragment]) -> Option<usize> {
        let (details, others): (Vec<&Fragment>, Vec<&Fragment>) =
            fragments.iter().partition(|f| self.brushes[f.brush].detail);
        self.choose_among(&others)
            .or_else(|| self.choose_among(&details))
    }

    fn choose_among(&self, fragments: &[&Fragment]) -> Option<usize> {
        for visible_only in [true, false] {
            let mut candidates: Vec<usize> = fragments
                .iter()
                .flat_map(|f| f.sides.iter())
                .filter(|s| !s.on_node && (s.visible || !visible_only))
                .map(|s| s.plane & !1)
                .collect();
            candidates.sort_unstable();
            candidates.dedup();
            let best = candidates
                .into_iter()
                .map(|p| (self.score(fragments, p), p));
            // The first of equals: the order of planes is that of the map.
            if let Some((_, plane)) = best.max_by_key(|(v, p)| (*v, std::cmp::Reverse(*p))) {
                return Some(plane);
            }
        }
        None
    }

    fn score(&self, fragments: &[&Fragment], plane_index: usize) -> i64 {
        let plane = self.planes.get(plane_index);
        let (mut front, mut back, mut cuts, mut on) = (0i64, 0i64, 0i64, 0i64);
        for f in fragments {
            let (hi, lo) = f.extent(&plane);
            front += i64::from(hi > ON_EPS);
            back += i64::from(lo < -ON_EPS);
            if hi > ON_EPS && lo < -ON_EPS {
                cuts += f.sides.iter().filter(|s| !s.on_node && s.visible).count() as i64 + 1;
            } else if f.has_plane(plane_index) {
                on += 1;
            }
        }
        5 * on - 5 * cuts - (front - back).abs() + if plane.axis().is_some() { 5 } else { 0 }
    }
}
