// SPDX-License-Identifier: GPL-3.0-or-later
// Kernels 8 to 11 of the path tracer's sixteen (transport/path_state.h names the bits).
#include "methods/path_tracing/kernel_body.h"

namespace afterglow::path_tracing {

template void render_request<8>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<9>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<10>(const KernelInput&, const PixelRequest&, RayCounts&);
template void render_request<11>(const KernelInput&, const PixelRequest&, RayCounts&);

}  // namespace afterglow::path_tracing
