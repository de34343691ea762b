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
inline void occluded(const int* valid, RTCScene scene, RTCRay4& rays) { rtcOccluded4(valid, scene, &rays); }
inline void occluded(const int* valid, RTCScene scene, RTCRay8& rays) { rtcOccluded8(valid, scene, &rays); }
inline void occluded(const int* valid, RTCScene scene, RTCRay16& rays) { rtcOccluded16(valid, scene, &rays); }
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
// Without the context's flag for rays that stay together: with it, rays through instances may never come back.
inline void occluded(const int* valid, RTCScene scene, RTCRay4& rays) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded4(valid, scene, &context, &rays);
}
inline void occluded(const int* valid, RTCScene scene, RTCRay8& rays) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded8(valid, scene, &context, &rays);
}
inline void occluded(const int* valid, RTCScene scene, RTCRay16& rays) {
  RTCIntersectContext context;
  rtcInitIntersectContext(&context);
  rtcOccluded16(valid, scene, &context, &rays);
}
#endif

}  // namespace afterglow::embree
