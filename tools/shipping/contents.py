# SPDX-License-Identifier: GPL-3.0-or-later
"""What a library that is inside one of our binaries asks to be said: its copyright, its licence and where its source is.

`CONTAINED` is keyed by the names that OpenImageIO's own list in the binary uses; a library that this list names and this
table does not stops the packaging. Versions come from the binary, commits from the recipes in OpenImageIO's source."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Notice:
    title: str
    copyrights: tuple[str, ...]
    licence: str  # a file under licenses/, without .txt
    source: str
    recipe: str = ""  # build_<recipe>.cmake in OpenImageIO's source names the exact commit
    marker: str = ""  # a regular expression that finds it in the binary where no list names it


GOOGLE = "https://github.com/google/"
CONTAINED = {
    "expat": Notice("Expat", ("1998-2000 Thai Open Source Software Center Ltd and Clark Cooper", "2001-2024 Expat maintainers"),
                    "mit", "https://github.com/libexpat/libexpat", "expat"),
    "fmt": Notice("{fmt}", ("2012-present Victor Zverovich and {fmt} contributors",), "mit",
                  "https://github.com/fmtlib/fmt", "fmt"),
    "Freetype": Notice("FreeType (portions of this software are copyright The FreeType Project, www.freetype.org)",
                       ("1996-2026 David Turner, Robert Wilhelm and Werner Lemberg",), "freetype",
                       "https://github.com/freetype/freetype", "Freetype"),
    "GIF": Notice("giflib", ("1997 Eric S. Raymond",), "mit", "https://git.code.sf.net/p/giflib/code", "GIF"),
    "Imath": Notice("Imath", ("Contributors to the OpenEXR Project",), "bsd_3_clause",
                    "https://github.com/AcademySoftwareFoundation/Imath", "Imath"),
    "JXL": Notice("libjxl", ("the JPEG XL Project Authors",), "bsd_3_clause", "https://github.com/libjxl/libjxl", "JXL"),
    "libdeflate": Notice("libdeflate", ("2016 Eric Biggers", "2024 Google LLC"), "mit",
                         "https://github.com/ebiggers/libdeflate", "libdeflate"),
    "libjpeg-turbo": Notice("libjpeg-turbo (this software is based in part on the work of the Independent JPEG Group)",
                            ("1991-2020 Thomas G. Lane, Guido Vollbeding", "2009-2026 D. R. Commander",
                             "2015 Viktor Szathmáry", "The libjpeg-turbo Project and many others"), "ijg",
                            "https://github.com/libjpeg-turbo/libjpeg-turbo", "libjpeg-turbo"),
    "libuhdr": Notice("libultrahdr", ("2022-2026 The Android Open Source Project",), "apache_2_0", GOOGLE + "libultrahdr",
                      "libuhdr"),
    "minizip-ng": Notice("minizip-ng", ("Nathan Moinvaziri", "1998-2010 Gilles Vollant"), "zlib",
                         "https://github.com/zlib-ng/minizip-ng", "minizip-ng"),
    "OpenColorIO": Notice("OpenColorIO", ("Contributors to the OpenColorIO Project",), "bsd_3_clause",
                          "https://github.com/AcademySoftwareFoundation/OpenColorIO", "OpenColorIO"),
    "OpenEXR": Notice("OpenEXR", ("Contributors to the OpenEXR Project",), "bsd_3_clause",
                      "https://github.com/AcademySoftwareFoundation/OpenEXR", "OpenEXR"),
    "OpenJPEG": Notice("OpenJPEG", ("2002-2014 Université catholique de Louvain (UCL), Belgium",
                                    "2002-2014 Professor Benoit Macq", "2003-2014 Antonin Descampe",
                                    "2003-2009 Francois-Olivier Devaux", "2005 Herve Drolon, FreeImage Team",
                                    "2002-2003 Yannick Verschueren", "2001-2003 David Janssens",
                                    "2011-2012 Centre National d'Etudes Spatiales (CNES), France",
                                    "2012 CS Systemes d'Information, France"), "bsd_2_clause",
                       "https://github.com/uclouvain/openjpeg", "OpenJPEG"),
    "openjph": Notice("OpenJPH", ("2019 Aous Naman", "2019 Kakadu Software Pty Ltd, Australia",
                                  "2019 The University of New South Wales, Australia"), "bsd_2_clause",
                      "https://github.com/aous72/OpenJPH", "openjph"),
    "PNG": Notice("libpng", ("1995-2026 The PNG Reference Library Authors",), "libpng_2_0",
                  "https://github.com/pnggroup/libpng", "PNG"),
    "pystring": Notice("pystring", ("2008-2010 Sony Pictures Imageworks Inc",), "bsd_3_clause",
                       "https://github.com/imageworks/pystring", "pystring"),
    "Robinmap": Notice("robin-map", ("2017 Thibaut Goetghebuer-Planchon",), "mit", "https://github.com/Tessil/robin-map",
                       "Robinmap"),
    "TIFF": Notice("libtiff", ("1988-1997 Sam Leffler", "1991-1997 Silicon Graphics, Inc."), "libtiff",
                   "https://gitlab.com/libtiff/libtiff", "TIFF"),
    "WebP": Notice("libwebp", ("2010 Google Inc.",), "bsd_3_clause", "https://chromium.googlesource.com/webm/libwebp (v1.5.0)"),
    "yaml-cpp": Notice("yaml-cpp", ("2008-2015 Jesse Beder",), "mit", "https://github.com/jbeder/yaml-cpp", "yaml-cpp"),
    "ZLIB": Notice("zlib (linked from the system; its header's code is inside)", ("1995-2024 Jean-loup Gailly and Mark Adler",),
                   "zlib", "https://github.com/madler/zlib", "ZLIB"),
    "zstd": Notice("Zstandard", ("Meta Platforms, Inc. and affiliates",), "bsd_3_clause", "https://github.com/facebook/zstd",
                   "zstd"),
}
# Named by the list, but nothing of them is in the library that we take: build tools, bindings, the system's parts.
OUTSIDE = {"nanobind", "pybind11", "Python3", "OpenGL", "JPEG"}
# Inside libraries of the list, which do not name them.
NESTED = (
    Notice("Highway (in libjxl)", ("Google LLC",), "apache_2_0", GOOGLE + "highway (third_party of libjxl 0.12.0)"),
    Notice("Brotli (in libjxl)", ("2009, 2010, 2013-2016 the Brotli Authors",), "mit",
           GOOGLE + "brotli (third_party of libjxl 0.12.0)", marker=r"BrotliEncoder"),
    Notice("skcms (in libjxl)", ("2018 Google Inc.",), "bsd_3_clause",
           "https://skia.googlesource.com/skcms (third_party of libjxl 0.12.0)"),
    Notice("image_io (in libultrahdr)", ("2017-2019 Google LLC",), "apache_2_0", GOOGLE + "libultrahdr (third_party/image_io)",
           marker=r"photos_editing_formats"),
    Notice("SampleICC (in OpenColorIO)", ("2003-2010 The International Color Consortium",), "sample_icc",
           "https://github.com/AcademySoftwareFoundation/OpenColorIO (ext/sampleicc)", marker=r"SampleICC"),
    Notice("pugixml (in OpenImageIO)", ("2006-2023 Arseny Kapoulkine",), "mit",
           "the source of OpenImageIO (src/include/OpenImageIO/detail/pugixml)", marker=r"pugi"),
    Notice("FarmHash (in OpenImageIO)", ("2014 Google, Inc.",), "mit",
           "the source of OpenImageIO (src/include/OpenImageIO/detail/farmhash.h)"),
    Notice("xxHash (in OpenImageIO and Zstandard)", ("2012-2023 Yann Collet",), "bsd_2_clause",
           "https://github.com/Cyan4973/xxHash"),
)
# What compilers and linkers put into every binary that they make: keyed by what a binary's section .comment says of them.
RUNTIMES = {
    r"GCC: \((?:GNU|Debian)": (
        Notice("GCC's run-time libraries (start-up objects, libgcc, what C++ templates bring, libstdc++_nonshared)",
               ("1988-2025 Free Software Foundation, Inc.",), "gcc_exception",
               "https://ftp.gnu.org/gnu/gcc/ (the versions named above; Red Hat's: https://git.centos.org/rpms/gcc)"),
        Notice("GNU C Library (start-up objects and libc_nonshared)", ("1991-2025 Free Software Foundation, Inc.",),
               "glibc_exception", "https://ftp.gnu.org/gnu/glibc/ (2.28; for the module also lib/libc/glibc of Zig's source)")),
    r"clang version .*intel/llvm": (
        Notice("LLVM (compiler-rt), as far as Intel's open compiler of Embree's binary brings it", ("LLVM contributors",),
               "apache_2_0", "https://github.com/intel/llvm, commit 54cbbec17bcad512f18881562c5f204936e9f3b3; with the LLVM "
               "exceptions: no notice is asked for what a compiler puts into its output"),),
    r"Linker: LLD|clang version [\d.]+$": (
        Notice("Zig's compiler runtime", ("Zig contributors",), "mit", "https://codeberg.org/ziglang/zig (0.17.1)"),),
}
# In the module that we compile and in Embree's own library.
OURS = (
    Notice("Embree 4.4.0", ("2009-2025 Intel Corporation",), "apache_2_0",
           "https://github.com/RenderKit/embree/archive/refs/tags/v4.4.0.tar.gz"),
    Notice("oneTBB 2022.1.0", ("2005-2025 Intel Corporation",), "apache_2_0",
           "http://deb.debian.org/debian/pool/main/o/onetbb/onetbb_2022.1.0.orig.tar.xz"),
    Notice("ITT API (in oneTBB)", ("2005-2023 Intel Corporation",), "bsd_3_clause",
           "the source of oneTBB (src/tbb/tools_api); https://github.com/intel/ittapi"),
    Notice("pybind11", ("2016 Wenzel Jakob and others",), "bsd_3_clause", "https://github.com/pybind/pybind11 (Debian 2.10.3-1)"),
    Notice("GLM", ("2005-present G-Truc Creation",), "mit", "https://github.com/g-truc/glm (Debian 0.9.9.8+ds-6)"),
    Notice("{fmt}, as far as headers of OpenImageIO bring it", ("2012-present Victor Zverovich",), "mit",
           "https://github.com/fmtlib/fmt (Debian 9.1.0+ds1-2)"),
    Notice("embreex, whose wheel Embree's library was taken from", ("2015 Anthony Scopatz",), "bsd_2_clause",
           "https://pypi.org/project/embreex/4.4.0.post1/"),
)
