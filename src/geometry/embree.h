#pragma once

// The one place where Embree 3 and Embree 4 differ for crownfit: how a single ray is traced. Only ray_caster.cpp
// includes this. CROWNFIT_EMBREE is the major version that CMake found.

#if CROWNFIT_EMBREE >= 4
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace crownfit {

#if CROWNFIT_EMBREE >= 4

using RayContext = RTCRayQueryContext;
/// Allows a filter function per query.
constexpr RTCSceneFlags kSceneFilters = RTC_SCENE_FLAG_FILTER_FUNCTION_IN_ARGUMENTS;

/// Nearest hit of a ray. `filter`, if any, may reject hits; it finds `context` in its arguments.
inline void Intersect(RTCScene scene, RayContext& context, RTCFilterFunctionN filter, RTCRayHit& query) {
  rtcInitRayQueryContext(&context);
  RTCIntersectArguments arguments;
  rtcInitIntersectArguments(&arguments);
  arguments.context = &context;
  arguments.filter = filter;
  if (filter) arguments.flags = RTC_RAY_QUERY_FLAG_INVOKE_ARGUMENT_FILTER;
  rtcIntersect1(scene, &query, &arguments);
}

/// Sets `ray.tfar` to minus infinity where anything is hit.
inline void Occlude(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray); }

#else

using RayContext = RTCIntersectContext;
constexpr RTCSceneFlags kSceneFilters = RTC_SCENE_FLAG_CONTEXT_FILTER_FUNCTION;

inline void Intersect(RTCScene scene, RayContext& context, RTCFilterFunctionN filter, RTCRayHit& query) {
  rtcInitIntersectContext(&context);
  context.filter = filter;
  rtcIntersect1(scene, &context, &query);
}

inline void Occlude(RTCScene scene, RTCRay& ray) {
  RayContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
}

#endif

}  // namespace crownfit
