// EGL's drivers as libglvnd finds them: JSON files that name a library each.
#pragma once

#include <string>

namespace gonio::gl {

// Result: a sentence on each of the files whose library cannot be opened, at most four; empty where all can. An image
// of a container may have the file of a GPU's driver without its library; EGL then says no more than that there is no
// display. Looks where libglvnd does: __EGL_VENDOR_LIBRARY_FILENAMES, else __EGL_VENDOR_LIBRARY_DIRS, else
// /etc/glvnd/egl_vendor.d and /usr/share/glvnd/egl_vendor.d. It opens the libraries. Any thread.
std::string dead_vendor_files();

}  // namespace gonio::gl
