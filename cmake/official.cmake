# SPDX-License-Identifier: GPL-3.0-or-later
# The module for Blender's own builds: the libraries that tools/shipping/dependencies.py prepared (AFTERGLOW_OFFICIAL names
# their folder), and a link step by zig, because g++ of Debian 12 can only link for the glibc that it runs on.
set(TBB_DIR ${AFTERGLOW_OFFICIAL}/lib/cmake/TBB)
find_package(TBB REQUIRED CONFIG)

add_library(embree SHARED IMPORTED)
set_target_properties(embree PROPERTIES IMPORTED_LOCATION ${AFTERGLOW_OFFICIAL}/lib/libafterglow_embree4.so)
set(EMBREE_INCLUDE_DIRS ${AFTERGLOW_OFFICIAL}/include)
target_compile_options(embree INTERFACE -include ${AFTERGLOW_OFFICIAL}/include/embree_renames.h)

set(OIIO_INCLUDE_DIR ${AFTERGLOW_OFFICIAL}/include)
set(OIIO_LIBRARY ${AFTERGLOW_OFFICIAL}/lib/libafterglow_oiio.so)
set(OIIO_UTIL_LIBRARY ${AFTERGLOW_OFFICIAL}/lib/libafterglow_oiio_util.so)

set(AFTERGLOW_ZIG "" CACHE FILEPATH "zig, which links for glibc 2.28")
execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=libstdc++.so.6 OUTPUT_VARIABLE STDCXX OUTPUT_STRIP_TRAILING_WHITESPACE)
execute_process(COMMAND ${CMAKE_CXX_COMPILER} -print-file-name=libgcc_s.so.1 OUTPUT_VARIABLE GCC_S OUTPUT_STRIP_TRAILING_WHITESPACE)
set(CMAKE_CXX_CREATE_SHARED_MODULE
  "${AFTERGLOW_ZIG} cc -target x86_64-linux-gnu.2.28 -shared -s -o <TARGET> <OBJECTS> <LINK_LIBRARIES> ${STDCXX} ${GCC_S} \
-Wl,--version-script=${CMAKE_CURRENT_LIST_DIR}/module.map -Wl,-Bsymbolic -Wl,--allow-shlib-undefined -Wl,-z,relro -Wl,-z,now \
-Wl,--gc-sections")
