// Any bytes into the TM-33 reader: a web that keeps its promises and survives the writer, or an error with a code and a
// place.
#include "tests/fuzz/ies_container_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::ies::fuzz::check_tm33({reinterpret_cast<const char*>(data), size});
    return 0;
}
