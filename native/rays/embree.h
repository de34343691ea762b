// SPDX-License-Identifier: GPL-3.0-or-later
// Everything in which Embree 3 and 4 differ, in one place. Included by rays/ alone.
#pragma once

#if __has_include(<embree4/rtcore.h>) && !defined(AFTERGLOW_EMBREE3)
#include <embree4/rtcore.h>
#else
#include <embree3/rtcore.h>
#endif

namespace afterglow::embree {

#if RTC_VERSION_MAJOR >= 4
inline void closest(RTCScene scene, RTCRayHit& ray) { rtcIntersect1(scene, &ray); }
inline void occluded(RTCScene scene, RTCRay& ray) { rtcOccluded1(scene, &ray); }
#else
inline void closest(RTCScene scene, RTCRayHit& ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcIntersect1(scene, &context, &ray);
}
inline void occluded(RTCScene scene, RTCRay& ray) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded1(scene, &context, &ray);
}
#endif

}  // namespace afterglow::embree
