// SPDX-License-Identifier: GPL-3.0-or-later
// Walks of wavefronts with passes beyond the picture (transport/path_state.h names the bits).
#include "render/wavefront_kernel.h"

namespace afterglow {

template void walk_request<13>(const path_tracing::KernelInput&, const PixelRequest&, WalkedRequest&);
template void walk_request<15>(const path_tracing::KernelInput&, const PixelRequest&, WalkedRequest&);

}  // namespace afterglow
