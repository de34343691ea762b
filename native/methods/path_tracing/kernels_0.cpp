// SPDX-License-Identifier: GPL-3.0-or-later
// Kernels 0 to 3 of the path tracer's sixteen (transport/path_state.h names the bits).
#include "methods/path_tracing/kernel_body.h"

namespace afterglow::path_tracing {

template void render_request<0>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<1>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<2>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<3>(const KernelInput&, const PixelRequest&, RayCounts&);

}  // namespace afterglow::path_tracing
