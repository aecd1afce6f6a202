// What memory is left, from files as the kernel writes them.
#include "server/base/memory_room.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>

namespace gonio {
namespace {

namespace fs = std::filesystem;

class MemoryRoomTest : public testing::Test {
protected:
    void SetUp() override {
        char name[] = "/tmp/gonio-memory-XXXXXX";
        folder = ::mkdtemp(name);
        write("proc/meminfo", "MemTotal:       2000000 kB\nMemFree:         10 kB\nMemAvailable:    1000000 kB\n");
        write("proc/self/statm", "50000 10000 1000 10 0 20000 0\n");
        write("proc/self/cgroup", "0::/system.slice/goniod.service\n");
    }
    void TearDown() override { fs::remove_all(folder); }
    void write(const std::string& file, const std::string& text) const {
        fs::create_directories(fs::path(folder + "/" + file).parent_path());
        std::ofstream(folder + "/" + file) << text;
    }
    std::size_t room(std::size_t most = 0) const { return memory_room(most, folder + "/proc", folder + "/cgroup"); }
    std::string folder;
};

TEST_F(MemoryRoomTest, WhatTheKernelSaysIsAvailable) {
    EXPECT_EQ(room(), 1'024'000'000u);
}

TEST_F(MemoryRoomTest, TheOptionBoundsWhatIsResident) {
    const std::size_t resident = 10000u * static_cast<std::size_t>(::sysconf(_SC_PAGESIZE));
    EXPECT_EQ(room(resident + 5'000'000), 5'000'000u);
    EXPECT_EQ(room(1000), 0u);
}

// systemd.resource-control(5), MemoryMax of a slice binds its services; cached files are given back.
TEST_F(MemoryRoomTest, TheTightestCgroupOnTheWayUp) {
    write("cgroup/system.slice/goniod.service/memory.max", "max\n");
    write("cgroup/system.slice/goniod.service/memory.current", "300000000\n");
    write("cgroup/system.slice/memory.max", "500000000\n");
    write("cgroup/system.slice/memory.current", "400000000\n");
    write("cgroup/system.slice/memory.stat", "anon 1\nfile 2\ninactive_file 50000000\nactive_file 3\n");
    EXPECT_EQ(room(), 150'000'000u);
}

TEST_F(MemoryRoomTest, CgroupsOfVersion1) {
    write("proc/self/cgroup", "12:cpu,cpuacct:/x\n4:memory:/docker/abc\n0::/\n");
    write("cgroup/memory/docker/abc/memory.limit_in_bytes", "200000000\n");
    write("cgroup/memory/docker/abc/memory.usage_in_bytes", "190000000\n");
    EXPECT_EQ(room(), 10'000'000u);
}

TEST_F(MemoryRoomTest, WhatCannotBeReadBoundsNothing) {
    fs::remove_all(folder + "/proc");
    EXPECT_GT(room(), std::size_t{1} << 40);
}

}  // namespace
}  // namespace gonio
