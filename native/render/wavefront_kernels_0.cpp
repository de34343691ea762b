// SPDX-License-Identifier: GPL-3.0-or-later
// Walks of wavefronts without passes beyond the picture (transport/path_state.h names the bits).
#include "render/wavefront_kernel.h"

namespace afterglow {

template void walk_request<5>(const path_tracing::KernelInput&, const PixelRequest&, WalkedRequest&);
template void walk_request<7>(const path_tracing::KernelInput&, const PixelRequest&, WalkedRequest&);

}  // namespace afterglow
