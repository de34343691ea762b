// SPDX-License-Identifier: GPL-3.0-or-later
// Kernels 4 to 7 of the path tracer's sixteen (transport/path_state.h names the bits).
#include "methods/path_tracing/kernel_body.h"

namespace afterglow::path_tracing {

template void render_request<4>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<5>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<6>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<7>(const KernelInput&, const PixelRequest&, RayCounts&);

}  // namespace afterglow::path_tracing
