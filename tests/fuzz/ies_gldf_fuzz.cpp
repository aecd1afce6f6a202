// Any bytes into the GLDF reader, as an archive and as the files of one.
#include "tests/fuzz/ies_container_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::ies::fuzz::check_gldf({reinterpret_cast<const char*>(data), size});
    return 0;
}
