// EGL's driver files whose library is not there, as containers have them.
#include "server/gl/vendor_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>

namespace gonio::gl {
namespace {

namespace fs = std::filesystem;

class VendorFiles : public testing::Test {
protected:
    VendorFiles() {
        char name[] = "/tmp/gonio_vendors_XXXXXX";
        folder_ = ::mkdtemp(name);
    }
    ~VendorFiles() override {
        ::unsetenv("__EGL_VENDOR_LIBRARY_FILENAMES");
        ::unsetenv("__EGL_VENDOR_LIBRARY_DIRS");
        fs::remove_all(folder_);
    }
    std::string write(const std::string& name, const std::string& library) const {
        const std::string path = (folder_ / name).string();
        std::ofstream(path) << R"({"file_format_version" : "1.0.0", "ICD" : {"library_path" : ")" << library << "\"}}";
        return path;
    }
    fs::path folder_;
};

TEST_F(VendorFiles, ADeadOneIsNamed) {
    const std::string dead = write("10_nvidia.json", "libgonio_no_such_driver.so.0"),
                      alive = write("50_mesa.json", "libdl.so.2");
    ::setenv("__EGL_VENDOR_LIBRARY_DIRS", folder_.c_str(), 1);
    EXPECT_EQ(dead_vendor_files(),
              "EGL's driver file " + dead + " names libgonio_no_such_driver.so.0, which cannot be opened");
    ::setenv("__EGL_VENDOR_LIBRARY_FILENAMES", alive.c_str(), 1);
    EXPECT_EQ(dead_vendor_files(), "");
    ::setenv("__EGL_VENDOR_LIBRARY_FILENAMES", (alive + ":" + dead + ":/nowhere.json").c_str(), 1);
    EXPECT_EQ(dead_vendor_files(), "EGL's driver file " + dead +
                                       " names libgonio_no_such_driver.so.0, which cannot be opened; EGL's driver "
                                       "file /nowhere.json is not there");
}

TEST_F(VendorFiles, FilesWithoutSense) {
    std::ofstream(folder_ / "a.json") << "{}";
    std::ofstream(folder_ / "b.json") << "\"library_path\"";
    std::ofstream(folder_ / "c.json") << "\"library_path\": \"open";
    for (int i = 0; i < 20; ++i) write("d" + std::to_string(i) + ".json", "libgonio_no_such_driver.so.0");
    ::setenv("__EGL_VENDOR_LIBRARY_DIRS", (folder_.string() + "::/nowhere").c_str(), 1);
    const std::string said = dead_vendor_files();
    EXPECT_NE(said.find("a.json names no library"), std::string::npos) << said;
    EXPECT_NE(said.find("c.json names no library"), std::string::npos) << said;
    EXPECT_NE(said.find("d0.json"), std::string::npos) << said;
    EXPECT_EQ(said.find("d1.json"), std::string::npos) << "four are named: " << said;
}

}  // namespace
}  // namespace gonio::gl
