// SPDX-License-Identifier: MIT
// Rays against the particles of a uniform grid: the views that go in, the functions that answer.
// Ray space: metres, the grid's lower corner at 0. A particle is hit where a ray ENTERS its ball at a
// distance > 0: the inside of a ball is snow, not surface, so a ray that starts inside one does not see it.
// Two lists over the same sorted particles: `cell_start` (by centre: coherent packets, density) and, for
// incoherent rays, `list`: all that overlap a cell. The second are made by the first ray that comes to a
// cell: few rays go deep into snow, so most cells never need theirs.
#pragma once
#include <cstddef>
#include <cstdint>

namespace firn::kernels {

inline constexpr std::uint32_t kNoHit = 0xffffffffu;
inline constexpr int kBrickCells = 4;      // a brick is 4x4x4 cells
inline constexpr int kCellsPerBrick = 64;  // z fastest
inline constexpr int kRayLanes = 16;

// 16 balls; a place without a ball has r2 = -1 and is never hit.
struct alignas(64) BallBundle {
  float x[kRayLanes], y[kRayLanes], z[kRayLanes];  // m
  float r2[kRayLanes];                             // m^2
  std::uint32_t particle[kRayLanes];               // sorted index
};

// The state of a cell's list, changed by whoever meets the cell first, with atomic operations. A list of n =
// word & 255 balls lies from lists + (word >> 8) * kListUnit on: x[n], y[n], z[n], their sorted indices, and
// r2[n] where radii differ. 0 is an empty one.
inline constexpr std::uint32_t kUnlisted = 0xffffffffu;  // nobody has asked yet
inline constexpr std::uint32_t kNoList = 0xfffffffeu;  // there is none (yet): read the cells around by centre
// Balls are entered in every cell within this of them, in cells: covers the rounding of a ray's walk.
inline constexpr float kCellMargin = 1e-3f;
inline constexpr std::uint32_t kMostListed = 255;  // balls
inline constexpr std::size_t kListUnit = 16;       // floats
inline constexpr std::uint64_t kMostUnits = (1ull << 24) - 1;

struct TraceGrid {
  float cell = 1, inv_cell = 1;  // m, 1/m
  int cells[3] = {0, 0, 0};      // multiples of 4
  int bricks[3] = {0, 0, 0};     // z fastest
  // Per brick: its place among the occupied ones; or -k, k >= 1: every brick closer than k (Chebyshev) is
  // empty.
  const std::int32_t* slot = nullptr;
  // Per cell of an occupied brick, one more at the end, into the sorted columns. 32 bits: there are no more
  // particles than ids.
  const std::uint32_t* cell_start = nullptr;
  const float *x = nullptr, *y = nullptr, *z = nullptr;  // sorted particles, m
  const float* radius = nullptr;                         // m; null: max_radius is that of all
  float max_radius = 0;                                  // m, of the particles in the cells
  std::uint32_t* list = nullptr;                         // per cell of an occupied brick
  float* lists = nullptr;                                // room for list_room units
  std::uint64_t* units_used = nullptr;
  std::uint64_t list_room = 0;
  const BallBundle* strays = nullptr;  // too large or too far for the cells: every ray tests them
  std::uint64_t stray_bundles = 0;
  // Cells across a packet of coherent rays, for each ray, from which on its rays go by other ways. 0: what is
  // fastest, by kind of ray; `firn-bench rule` asks for others.
  float cells_per_ray = 0;
};

// Columns of rays. Directions are unit vectors. `t` is the reach on entry (m, may be infinite) and the
// distance of the hit on return; `hit` is the sorted index of the particle or kNoHit, in which case t is
// unchanged.
struct RayView {
  const float* origin[3];
  const float* direction[3];
  float* t;
  std::uint32_t* hit;
};
// Rays that may scatter on their way: origin and direction become those of the last flight.
struct WalkView {
  float* origin[3];
  float* direction[3];
  float* t;
  std::uint32_t* hit;
  std::uint32_t* scattered;  // how often, and in what depth the last time: count | class << 28
  // The collisions on the way that were drawn to be connected to lights, each ray's in order; room for
  // kMostLit a ray behind the lit_count that are there.
  struct LitCollision* lit;
  std::size_t* lit_count;
};
struct LitCollision {
  float p[3];                    // m
  std::uint32_t ray, scattered;  // as above, with this one
};

// Fields of the snow stand on the corners of the cells, 5x5x5 of them in each occupied brick (those on its
// sides are its neighbours' too), and are trilinear in between. They are gathered in tiles: the 7x7x7 corners
// that particles of a brick reach, from one before the brick's first, in rows of eight.
inline constexpr int kCornerSide = 5;
inline constexpr int kBrickCorners = kCornerSide * kCornerSide * kCornerSide;
inline constexpr int kFieldTileSide = 7, kFieldTileRow = 8;
inline constexpr int kFieldTile = kFieldTileSide * kFieldTileSide * kFieldTileRow;

// The implicit surface fill = level. Snow is where the fill is at least the level.
enum CellKind : std::uint32_t {  // by the cell's corners: none, some, all in snow
  kOutside,
  kCrossed,
  kInside,
  kHasLoose = 4  // a flag: loose balls reach into the cell
};
struct SurfaceField {
  const float* fill = nullptr;               // per occupied brick: kBrickCorners, 1 in evenly packed snow
  const std::uint32_t* cell_kind = nullptr;  // per occupied brick: eight words, four bits a cell
  float level = 0.5f;
};
inline constexpr std::uint32_t kSurfaceHit = 0xfffffffeu;

// What flights must know of a cell of the medium, in one word: the most extinction there is in it (reduced
// where it is deep; 1/m, 0: no snow), a float with kMostExtinction of its bits, rounded up; the least as a
// share of that; the class of its depth, from 0 at the surface to at most 7; and two flags.
inline constexpr std::uint32_t kMostExtinction = 0x7ffff000u;
inline constexpr int kLeastAt = 4, kLeastBits = 8;  // the share in units of 1 / 2^kLeastBits
inline constexpr std::uint32_t kClass = 7, kThickSnow = 8;
inline constexpr std::uint32_t kShared = 0x80000000u;  // something else may be there: walks must come back

inline constexpr std::uint32_t kMostScattered = 256;

// What of the snow scatters light, as fields over the cells of a TraceGrid.
struct MediumField {
  const float* density = nullptr;            // per occupied brick kBrickCorners, kg/m^3
  const float* fill = nullptr;               // as SurfaceField: snow is where it is at least the level
  const std::uint32_t* cell = nullptr;       // per cell of an occupied brick, as above
  const std::uint32_t* cell_kind = nullptr;  // as SurfaceField
  float level = 0.5f;
  float extinction = 0;        // m^2/kg, times the density: 1/m
  float reduced = 0;           // m^2/kg, the same in cells of class 1 and more
  const float* lit = nullptr;  // per class, the chance that a walk's collision there is to be lit
  std::uint32_t most_scattered = kMostScattered;  // of one walk: then it comes back, for roulette
  // kg/m^3 in the loose balls. Negative: the snow is balls alone, within which the density field counts.
  float ball_density = 0;
  const float* stray_extinction = nullptr;  // per stray (16 a bundle), 1/m
};
// Collisions: the class of the cell's depth; with kUnlit where a walk was not drawn to be lit; with
// kInThickSnow where the cell is.
inline constexpr std::uint32_t kUnlit = 8, kInThickSnow = 16;
inline constexpr std::uint32_t kMostLit = 32;  // of one walk

// Boxes around the children of a node in a tree of triangles. child: a node, or ~k for triangle bundle k.
struct alignas(64) BoxBundle {
  float low[3][kRayLanes], high[3][kRayLanes];  // m, with the margin
  std::int32_t child[kRayLanes];
  std::int32_t count;
};
// Of MeshView::size, what boxes are padded by and triangles may be missed by: roundings of a float are 6e-8
// of it, and some ten of them add up.
inline constexpr float kMeshMargin = 4e-6f;
// Of the rectangle around a triangle as a ray sees it: with less area it is seen edge on, and its area is too
// rounded (to some 1e-15 of the rectangle) to say where the ray meets it.
inline constexpr double kMeshEdgeOn = 1e-9;
inline constexpr int kMostMeshDepth = 80;  // nodes above one another
// Triangles by their first corner and the two edges from it; a place without one has index -1.
struct alignas(64) TriangleBundle {
  float a[3][kRayLanes], u[3][kRayLanes], v[3][kRayLanes];  // m
  std::int32_t index[kRayLanes];                            // of the triangle
  float longest;                                            // m, of the edges u and v
};
// A mesh in a frame of its own. The tree's first node is its root; null: there are no triangles.
struct MeshView {
  const BoxBundle* nodes = nullptr;
  const TriangleBundle* triangles = nullptr;
  const double* vertices = nullptr;       // m, x, y, z
  const std::int32_t* corners = nullptr;  // three vertices a triangle
  double low[3], high[3];                 // m, of the root, with its margin
  float size = 0;                         // m, the diagonal and the largest coordinate together
};

struct Extent {
  float low, high;  // infinite if there is nothing
  bool finite;      // every value, and their sum
};

// Columns of points and directions (unit or 0): a probe goes some way from its point.
struct ProbeView {
  const float* origin[3];
  const float* direction[3];
};

struct TraceKernels {
  // Of column[begin, end).
  Extent (*extent)(const float* column, std::size_t begin, std::size_t end) = nullptr;
  // Of the particles at position + shift (m, render space): brick << 6 | cell in it, the brick by its place
  // in the table; one brick beyond the table for those outside the grid. Reads the grid's sizes only.
  void (*cell_codes)(const TraceGrid&, const float* const position[3], const float shift[3],
                     std::size_t begin, std::size_t end, std::uint32_t* code) = nullptr;
  // The nearest hit of each ray in [begin, end); of equal distances the lowest index.
  void (*closest)(const TraceGrid&, const RayView&, std::size_t begin, std::size_t end) = nullptr;
  // The same bits, faster where neighbours in the columns are neighbours in space, as camera rays are.
  void (*closest_coherent)(const TraceGrid&, const RayView&, std::size_t begin, std::size_t end) = nullptr;
  // Any hit nearer than the reach: `hit` is 0 where there is one, else kNoHit; t is left alone.
  void (*occluded)(const TraceGrid&, const RayView&, std::size_t begin, std::size_t end) = nullptr;
  // The same, faster where neighbours in the columns start near one another and go the same way.
  void (*occluded_coherent)(const TraceGrid&, const RayView&, std::size_t begin, std::size_t end) = nullptr;
  // Adds amount[s] of each sorted particle of [begin, end) to the corners around it, by the weights of P2G
  // (the quadratic B-spline). They lie in the brick whose first cell is `first`; tile: kFieldTile.
  void (*splat)(const TraceGrid&, const int first[3], std::uint32_t begin, std::uint32_t end,
                const float* amount, float* tile) = nullptr;
  // Adds to the corners of a brick (kBrickCorners) what the tiles of the 27 bricks around it (x slowest;
  // null: none) hold there, in that order.
  void (*sum_tiles)(const float* const tiles[27], float* corners) = nullptr;
  // As `closest` and `occluded`, but against the surface of the snow too, where the ray enters it: `hit` is
  // kSurfaceHit there. Balls of radius -1 are none.
  void (*surface_closest)(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t begin,
                          std::size_t end) = nullptr;
  void (*surface_occluded)(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t begin,
                           std::size_t end) = nullptr;
  // The same to rounding, faster where neighbours in the columns start near one another and go the same way.
  void (*surface_closest_coherent)(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t begin,
                                   std::size_t end) = nullptr;
  void (*surface_occluded_coherent)(const TraceGrid&, const SurfaceField&, const RayView&, std::size_t begin,
                                    std::size_t end) = nullptr;
  // How far each ray gets through the snow, by delta tracking with a majorant a cell (Woodcock 1965): `hit`
  // is the class of the cell where it collided (and kInThickSnow), or kNoHit where it passed. Rays may start
  // in the snow. key: one per ray; its random numbers are hashes of the key and of how many it has drawn.
  // share: one per ray, what of the extinction counts for it, in (0, 1]; null: all.
  void (*collide)(const TraceGrid&, const MediumField&, const RayView&, const std::uint64_t* key,
                  const float* share, std::size_t begin, std::size_t end) = nullptr;
  // The same, but a ray of share < 1 that collides scatters isotropically and goes on, again and again: until
  // a collision might lie behind something else than snow on its flight, or the ray passes, or it has
  // scattered or was lit as often as it may. Collisions are drawn to be lit by their cells' classes.
  void (*wander)(const TraceGrid&, const MediumField&, const WalkView&, const std::uint64_t* key,
                 const float* share, std::size_t begin, std::size_t end) = nullptr;
  // A field on corners (kBrickCorners per occupied brick), trilinear, at origin + distance * direction (m) of
  // each probe in [begin, end); 0 outside the cells.
  void (*probe)(const TraceGrid&, const float* field, const ProbeView&, float distance, std::size_t begin,
                std::size_t end, float* value) = nullptr;
  // The nearest triangle that o + t d (the mesh's frame) meets at 0 < t < limit, from either side: t, and
  // which; else `limit`, and `triangle` as it was. Of equal distances the lower index.
  double (*mesh_closest)(const MeshView&, const double o[3], const double d[3], double limit,
                         std::int32_t& triangle) = nullptr;
  // Whether there is one.
  bool (*mesh_occluded)(const MeshView&, const double o[3], const double d[3], double limit) = nullptr;
};

}  // namespace firn::kernels
