// SPDX-License-Identifier: MIT
#include "bench/embree.h"

#include <algorithm>
#include <cstring>
#include <limits>

#include "firn/error.h"

namespace firn::bench {

namespace {

using kernels::kNoHit;
using kernels::RayView;

constexpr float kOccluded = -std::numeric_limits<float>::infinity();  // tfar of a ray that met something

// Calls that differ between the versions.
#if RTC_VERSION_MAJOR >= 4
struct Query {
  RTCIntersectArguments closest;
  RTCOccludedArguments any;
  explicit Query(bool coherent) {
    rtcInitIntersectArguments(&closest);
    rtcInitOccludedArguments(&any);
    const auto flags = coherent ? RTC_RAY_QUERY_FLAG_COHERENT : RTC_RAY_QUERY_FLAG_INCOHERENT;
    closest.flags = flags;
    any.flags = flags;
  }
};
void intersect(RTCScene s, Query& q, const int*, RTCRayHit& r) { rtcIntersect1(s, &r, &q.closest); }
void intersect(RTCScene s, Query& q, const int* valid, RTCRayHitNt<8>& r) {
  rtcIntersect8(valid, s, reinterpret_cast<RTCRayHit8*>(&r), &q.closest);
}
void intersect(RTCScene s, Query& q, const int* valid, RTCRayHitNt<16>& r) {
  rtcIntersect16(valid, s, reinterpret_cast<RTCRayHit16*>(&r), &q.closest);
}
void occluded(RTCScene s, Query& q, const int*, RTCRay& r) { rtcOccluded1(s, &r, &q.any); }
void occluded(RTCScene s, Query& q, const int* valid, RTCRayNt<8>& r) {
  rtcOccluded8(valid, s, reinterpret_cast<RTCRay8*>(&r), &q.any);
}
void occluded(RTCScene s, Query& q, const int* valid, RTCRayNt<16>& r) {
  rtcOccluded16(valid, s, reinterpret_cast<RTCRay16*>(&r), &q.any);
}
#else
struct Query {
  RTCIntersectContext context;
  explicit Query(bool coherent) {
    rtcInitIntersectContext(&context);
    context.flags = coherent ? RTC_INTERSECT_CONTEXT_FLAG_COHERENT : RTC_INTERSECT_CONTEXT_FLAG_INCOHERENT;
  }
};
void intersect(RTCScene s, Query& q, const int*, RTCRayHit& r) { rtcIntersect1(s, &q.context, &r); }
void intersect(RTCScene s, Query& q, const int* valid, RTCRayHitNt<8>& r) {
  rtcIntersect8(valid, s, &q.context, reinterpret_cast<RTCRayHit8*>(&r));
}
void intersect(RTCScene s, Query& q, const int* valid, RTCRayHitNt<16>& r) {
  rtcIntersect16(valid, s, &q.context, reinterpret_cast<RTCRayHit16*>(&r));
}
void occluded(RTCScene s, Query& q, const int*, RTCRay& r) { rtcOccluded1(s, &q.context, &r); }
void occluded(RTCScene s, Query& q, const int* valid, RTCRayNt<8>& r) {
  rtcOccluded8(valid, s, &q.context, reinterpret_cast<RTCRay8*>(&r));
}
void occluded(RTCScene s, Query& q, const int* valid, RTCRayNt<16>& r) {
  rtcOccluded16(valid, s, &q.context, reinterpret_cast<RTCRay16*>(&r));
}
#endif

// How rays are handed over.
enum class Call {
  single,
  packet8,
  packet16,
#if RTC_VERSION_MAJOR < 4
  stream,
#endif
};
struct Way {
  Call call;
  bool coherent;
  const char* name;
};
constexpr Way kWays[] = {
    {Call::single, false, "rtcIntersect1"},
    {Call::packet8, false, "rtcIntersect8"},
    {Call::packet16, false, "rtcIntersect16"},
    {Call::packet8, true, "rtcIntersect8, coherent"},
    {Call::packet16, true, "rtcIntersect16, coherent"},
#if RTC_VERSION_MAJOR < 4
    {Call::stream, false, "rtcIntersectNp"},
    {Call::stream, true, "rtcIntersectNp, coherent"},
#endif
};

void load(const RayView& rays, std::size_t i, RTCRay& ray) {
  ray = {rays.origin[0][i],
         rays.origin[1][i],
         rays.origin[2][i],
         0,
         rays.direction[0][i],
         rays.direction[1][i],
         rays.direction[2][i],
         0,
         rays.t[i],
         ~0u,
         0,
         0};
}

void trace_singly(RTCScene scene, Query& query, bool any, const RayView& rays, std::size_t begin,
                  std::size_t end) {
  for (std::size_t i = begin; i < end; ++i) {
    RTCRayHit r;
    load(rays, i, r.ray);
    r.hit.geomID = r.hit.instID[0] = RTC_INVALID_GEOMETRY_ID;
    if (any) {
      occluded(scene, query, nullptr, r.ray);
      rays.hit[i] = r.ray.tfar == kOccluded ? 0 : kNoHit;
      continue;
    }
    intersect(scene, query, nullptr, r);
    rays.t[i] = r.ray.tfar;
    rays.hit[i] = r.hit.geomID == RTC_INVALID_GEOMETRY_ID ? kNoHit : r.hit.primID;
  }
}

template <int N>
void trace_packets(RTCScene scene, Query& query, bool any, const RayView& rays, std::size_t begin,
                   std::size_t end) {
  alignas(64) RTCRayHitNt<N> r;
  alignas(64) int valid[N];
  for (; begin < end; begin += N) {
    const std::size_t count = std::min<std::size_t>(N, end - begin);
    const auto fill = [&](float* to, const float* from) {
      std::memcpy(to, from + begin, count * sizeof(float));
    };
    fill(r.ray.org_x, rays.origin[0]);
    fill(r.ray.org_y, rays.origin[1]);
    fill(r.ray.org_z, rays.origin[2]);
    fill(r.ray.dir_x, rays.direction[0]);
    fill(r.ray.dir_y, rays.direction[1]);
    fill(r.ray.dir_z, rays.direction[2]);
    fill(r.ray.tfar, rays.t);
    for (int lane = 0; lane < N; ++lane) {
      valid[lane] = lane < static_cast<int>(count) ? -1 : 0;
      r.ray.tnear[lane] = r.ray.time[lane] = 0;
      r.ray.mask[lane] = ~0u;
      r.ray.id[lane] = r.ray.flags[lane] = 0;
      r.hit.geomID[lane] = r.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
    }
    if (any) {
      occluded(scene, query, valid, r.ray);
      for (std::size_t lane = 0; lane < count; ++lane) {
        rays.hit[begin + lane] = r.ray.tfar[lane] == kOccluded ? 0 : kNoHit;
      }
      continue;
    }
    intersect(scene, query, valid, r);
    for (std::size_t lane = 0; lane < count; ++lane) {
      rays.t[begin + lane] = r.ray.tfar[lane];
      rays.hit[begin + lane] = r.hit.geomID[lane] == RTC_INVALID_GEOMETRY_ID ? kNoHit : r.hit.primID[lane];
    }
  }
}

#if RTC_VERSION_MAJOR < 4

// Columns that a stream needs beside the rays'. One for each thread.
struct StreamColumns {
  std::vector<float> zero, far, normal[3], u, v;
  std::vector<unsigned> all, id, flags, geometry, instance;

  void resize(std::size_t count) {
    if (zero.size() >= count) return;
    for (auto* column : {&zero, &far, &normal[0], &normal[1], &normal[2], &u, &v}) column->assign(count, 0);
    all.assign(count, ~0u);
    for (auto* column : {&id, &flags, &geometry, &instance}) column->assign(count, 0);
  }
};

void trace_stream(RTCScene scene, Query& query, bool any, const RayView& rays, std::size_t begin,
                  std::size_t end) {
  thread_local StreamColumns c;
  const std::size_t count = end - begin;
  c.resize(count);
  const auto column = [&](const float* from) { return const_cast<float*>(from + begin); };  // not written to
  RTCRayHitNp r;
  r.ray = {column(rays.origin[0]),
           column(rays.origin[1]),
           column(rays.origin[2]),
           c.zero.data(),
           column(rays.direction[0]),
           column(rays.direction[1]),
           column(rays.direction[2]),
           c.zero.data(),
           rays.t + begin,
           c.all.data(),
           c.id.data(),
           c.flags.data()};
  if (any) {
    std::copy(rays.t + begin, rays.t + end, c.far.begin());
    r.ray.tfar = c.far.data();
    rtcOccludedNp(scene, &query.context, &r.ray, static_cast<unsigned>(count));
    for (std::size_t i = 0; i < count; ++i) rays.hit[begin + i] = c.far[i] == kOccluded ? 0 : kNoHit;
    return;
  }
  r.hit = {c.normal[0].data(), c.normal[1].data(), c.normal[2].data(), c.u.data(),
           c.v.data(),         rays.hit + begin,   c.geometry.data(),  {c.instance.data()}};
  std::fill_n(c.geometry.begin(), count, RTC_INVALID_GEOMETRY_ID);
  std::fill_n(c.instance.begin(), count, RTC_INVALID_GEOMETRY_ID);
  rtcIntersectNp(scene, &query.context, &r, static_cast<unsigned>(count));
  for (std::size_t i = 0; i < count; ++i) {
    if (c.geometry[i] == RTC_INVALID_GEOMETRY_ID) rays.hit[begin + i] = kNoHit;
  }
}

#endif

bool count_bytes(void* sum, ssize_t bytes, bool) {
  static_cast<std::atomic<std::ptrdiff_t>*>(sum)->fetch_add(bytes);
  return true;
}

}  // namespace

EmbreeScene::EmbreeScene(RTCGeometryType type, int threads) {
  device_ = rtcNewDevice(("threads=" + std::to_string(threads)).c_str());
  if (device_ == nullptr) throw Error(ErrorCode::failed, "Embree", "makes no device");
  rtcSetDeviceMemoryMonitorFunction(device_, count_bytes, &bytes_);
  scene_ = rtcNewScene(device_);
  geometry_ = rtcNewGeometry(device_, type);
  rtcAttachGeometry(scene_, geometry_);
}

EmbreeScene::~EmbreeScene() {
  rtcReleaseGeometry(geometry_);
  rtcReleaseScene(scene_);
  rtcReleaseDevice(device_);
}

void EmbreeScene::commit() {
  rtcCommitGeometry(geometry_);
  rtcCommitScene(scene_);
  if (const RTCError error = rtcGetDeviceError(device_); error != RTC_ERROR_NONE) {
    throw Error(ErrorCode::failed, "Embree", "cannot build: error " + std::to_string(error));
  }
}

std::string EmbreeScene::version() { return RTC_VERSION_STRING; }

std::vector<std::string> EmbreeScene::ways() {
  std::vector<std::string> names;
  for (const Way& way : kWays) names.emplace_back(way.name);
  return names;
}

std::vector<std::string> EmbreeScene::single_ray_ways() { return {kWays[0].name}; }

void EmbreeScene::trace(std::size_t way, RayKind kind, const RayView& rays, std::size_t begin,
                        std::size_t end) const {
  Query query(kWays[way].coherent);
  const bool any = kind == RayKind::shadow;
  switch (kWays[way].call) {
    case Call::single:
      return trace_singly(scene_, query, any, rays, begin, end);
    case Call::packet8:
      return trace_packets<8>(scene_, query, any, rays, begin, end);
    case Call::packet16:
      return trace_packets<16>(scene_, query, any, rays, begin, end);
#if RTC_VERSION_MAJOR < 4
    case Call::stream:
      return trace_stream(scene_, query, any, rays, begin, end);
#endif
  }
}

}  // namespace firn::bench
