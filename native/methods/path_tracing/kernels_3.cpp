// SPDX-License-Identifier: GPL-3.0-or-later
// Kernels 12 to 15 of the path tracer's sixteen (transport/path_state.h names the bits).
#include "methods/path_tracing/kernel_body.h"

namespace afterglow::path_tracing {

template void render_request<12>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<13>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<14>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<15>(const KernelInput&, const PixelRequest&, RayCounts&);

}  // namespace afterglow::path_tracing
