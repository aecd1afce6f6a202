// A JOB.json in any bytes.
#include "tests/fuzz/job_check.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
    gonio::fuzz::check_job({reinterpret_cast<const char*>(data), size});
    return 0;
}
