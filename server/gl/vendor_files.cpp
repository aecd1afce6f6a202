#include "server/gl/vendor_files.h"

#include <dlfcn.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <vector>

namespace gonio::gl {
namespace {

namespace fs = std::filesystem;

constexpr std::size_t kMostNamed = 4, kMostFiles = 100, kMostBytes = 65'536;

std::vector<std::string> parts_of(const std::string& list) {
    std::vector<std::string> parts;
    for (std::size_t at = 0; at <= list.size();) {
        const std::size_t end = std::min(list.find(':', at), list.size());
        if (end > at) parts.push_back(list.substr(at, end - at));
        at = end + 1;
    }
    return parts;
}

std::vector<std::string> vendor_files() {
    if (const char* const files = std::getenv("__EGL_VENDOR_LIBRARY_FILENAMES")) return parts_of(files);
    const char* const folders = std::getenv("__EGL_VENDOR_LIBRARY_DIRS");
    std::vector<std::string> found;
    for (const std::string& folder :
         parts_of(folders != nullptr ? folders : "/etc/glvnd/egl_vendor.d:/usr/share/glvnd/egl_vendor.d")) {
        std::error_code failed;
        for (const fs::directory_entry& entry : fs::directory_iterator(folder, failed))
            if (entry.path().extension() == ".json" && found.size() < kMostFiles)
                found.push_back(entry.path().string());
    }
    std::sort(found.begin(), found.end());
    return found;
}

// What stands between the quotes behind "library_path"; empty where the file has none.
std::string library_of(const std::string& file) {
    std::ifstream stream(file, std::ios::binary);
    std::string text(kMostBytes, '\0');
    stream.read(text.data(), static_cast<std::streamsize>(text.size()));
    text.resize(static_cast<std::size_t>(std::max<std::streamsize>(stream.gcount(), 0)));
    constexpr std::string_view kKey = "\"library_path\"";
    const std::size_t key = text.find(kKey);
    if (key == std::string::npos) return {};
    const std::size_t begin = text.find('"', key + kKey.size());
    const std::size_t end = begin == std::string::npos ? begin : text.find('"', begin + 1);
    return end == std::string::npos ? std::string() : text.substr(begin + 1, end - begin - 1);
}

}  // namespace

std::string dead_vendor_files() {
    std::string said;
    std::size_t named = 0;
    for (const std::string& file : vendor_files()) {
        std::error_code failed;
        const bool there = fs::is_regular_file(file, failed);
        const std::string library = there ? library_of(file) : std::string();
        if (!library.empty()) {
            // A handle stays open: EGL may have the library as well, and some do not survive it.
            if (::dlopen(library.c_str(), RTLD_LAZY | RTLD_LOCAL) != nullptr) continue;
        }
        if (++named > kMostNamed) break;
        said += (said.empty() ? "" : "; ") + std::string("EGL's driver file ") + file +
                (!there            ? " is not there"
                 : library.empty() ? " names no library"
                                   : " names " + library + ", which cannot be opened");
    }
    return said;
}

}  // namespace gonio::gl
