#!/usr/bin/env python3
"""run.py PROGRAM WORKDIR: the input code against a real kernel. Boots Debian's kernel in QEMU (TCG: needs no KVM) with an
initramfs of busybox, udevd, the shipped udev rules and PROGRAM, and says what PROGRAM said. Ends with 77 where QEMU or the
kernel cannot be had. WORKDIR keeps the kernel for the next time."""
import glob
import gzip
import lzma
import os
import re
import shutil
import subprocess
import sys
import time

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
MODULES = ["uhid", "usbhid", "hid-generic", "dummy_hcd", "usb_f_hid", "usb_f_midi", "snd-usb-audio"]
TOOLS = ["qemu-system-x86_64", "busybox", "cpio", "modprobe", "depmod", "udevadm"]


def skip(why):
    print("skipped: " + why)
    sys.exit(77)


def run(*words, **more):
    return subprocess.run(words, check=True, **more)


def kernel(work):
    """The folder of the unpacked kernel package, and its ELF image, which boots without unpacking itself."""
    image = os.path.join(work, "vmlinux")
    root = os.path.join(work, "root")
    if os.path.exists(image):
        return root, image
    shutil.rmtree(root, ignore_errors=True)
    text = subprocess.run(["apt-cache", "depends", "linux-image-amd64"], capture_output=True, text=True).stdout
    found = re.search(r"Depends: (linux-image-\S+)", text)
    if not found:
        skip("apt knows no kernel package (linux-image-amd64)")
    if subprocess.run(["apt-get", "download", "-q", found.group(1)], cwd=work, capture_output=True).returncode:
        skip("the kernel package cannot be downloaded")
    package = glob.glob(os.path.join(work, found.group(1) + "_*.deb"))[0]
    run("dpkg", "-x", package, root)
    os.remove(package)
    packed = open(glob.glob(os.path.join(root, "boot/vmlinuz-*"))[0], "rb").read()
    elf = lzma.LZMADecompressor().decompress(packed[packed.find(b"\xfd7zXZ\0"):])
    assert elf[:4] == b"\x7fELF"
    run("depmod", "-b", root, os.listdir(os.path.join(root, "lib/modules"))[0])
    with open(image + ".part", "wb") as file:
        file.write(elf)
    os.rename(image + ".part", image)
    return root, image


def copy(source, folder, target):
    path = folder + target
    os.makedirs(os.path.dirname(path), exist_ok=True)
    shutil.copy(os.path.realpath(source), path)


def add_program(source, folder, target):
    """A program with the libraries that it is linked with."""
    copy(source, folder, target)
    libraries = subprocess.run(["ldd", source], capture_output=True, text=True).stdout
    for library in re.findall(r"(/\S+\.so\S*)", libraries):
        if not os.path.exists(folder + library):
            copy(library, folder, library)


def initramfs(work, root, program):
    folder = os.path.join(work, "guest")
    shutil.rmtree(folder, ignore_errors=True)
    for name in ["bin", "sbin", "dev", "proc", "sys", "tmp", "run", "etc/udev/rules.d", "lib/udev/rules.d", "lib/systemd"]:
        os.makedirs(os.path.join(folder, name))
    copy(shutil.which("busybox"), folder, "/bin/busybox")
    for applet in subprocess.run(["busybox", "--list"], capture_output=True, text=True, check=True).stdout.split():
        if applet != "busybox":
            os.symlink("busybox", os.path.join(folder, "bin", applet))
    version = os.listdir(os.path.join(root, "lib/modules"))[0]
    for module in MODULES:
        for line in subprocess.run(["modprobe", "-d", root, "-S", version, "--show-depends", module], capture_output=True, text=True,
                                   check=True).stdout.splitlines():
            if line.startswith("insmod "):
                path = line.split()[1]
                copy(path, folder, path[path.index("/lib/modules"):])
    for name in ["order", "builtin", "builtin.modinfo"]:
        copy(f"{root}/lib/modules/{version}/modules.{name}", folder, f"/lib/modules/{version}/modules.{name}")
    run("depmod", "-b", folder, version)
    add_program(program, folder, "/bin/usb_guest_tests")
    add_program(shutil.which("udevadm"), folder, "/bin/udevadm")
    copy(shutil.which("udevadm"), folder, "/lib/systemd/systemd-udevd")  # its first argument decides which program it is
    copy("/usr/lib/udev/rules.d/50-udev-default.rules", folder, "/lib/udev/rules.d/50-udev-default.rules")
    copy(f"{ROOT}/packaging/70-gonio.rules", folder, "/etc/udev/rules.d/70-gonio.rules")
    groups = "root:0 gonio:990 tty:5 dialout:20 audio:29 video:44 input:104 kvm:105 disk:6 lp:7 kmem:15 cdrom:24 tape:26 render:106 sgx:107"
    with open(folder + "/etc/group", "w") as file:
        file.writelines("{}:x:{}:\n".format(*group.split(":")) for group in groups.split())
    with open(folder + "/etc/passwd", "w") as file:
        file.write("root:x:0:0::/:/bin/sh\nuser:x:1000:990::/:/bin/sh\n")
    with open(folder + "/etc/nsswitch.conf", "w") as file:
        file.write("passwd: files\ngroup: files\n")
    copy(f"{HERE}/init", folder, "/init")
    os.chmod(folder + "/init", 0o755)
    names = "\n".join(os.path.relpath(os.path.join(base, name), folder) for base, folders, files in os.walk(folder)
                      for name in folders + files)
    packed = subprocess.run(["cpio", "-o", "-H", "newc", "--quiet", "-R", "0:0"], cwd=folder, input=names.encode(),
                            capture_output=True, check=True).stdout
    path = os.path.join(work, "initramfs.gz")
    with open(path, "wb") as file:
        file.write(gzip.compress(packed, 1))
    return path


def main():
    program, work = os.path.abspath(sys.argv[1]), os.path.abspath(sys.argv[2])
    missing = [tool for tool in TOOLS if not shutil.which(tool, path=os.environ["PATH"] + ":/usr/sbin:/sbin")]
    if missing:
        skip("not installed: " + " ".join(missing) + " (see packages.txt)")
    os.environ["PATH"] += ":/usr/sbin:/sbin"
    os.makedirs(work, exist_ok=True)
    root, image = kernel(work)
    began = time.monotonic()
    disk = initramfs(work, root, program)
    # The clock follows executed instructions: pauses cost nothing, and a busy host cannot make the guest's times run out.
    words = ["qemu-system-x86_64", "-accel", "tcg,thread=single", "-icount", "shift=2,sleep=off", "-cpu", "max", "-m", "512",
             "-display", "none", "-nodefaults", "-serial", "stdio", "-no-reboot", "-kernel", image, "-initrd", disk, "-append",
             "console=ttyS0 quiet panic=-1 tsc=reliable"]
    said = ""
    with subprocess.Popen(words, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, text=True, errors="replace") as guest:
        for line in guest.stdout:
            said += line
            print(line.rstrip(), flush=True)
    print(f"took {time.monotonic() - began:.1f} s")
    sys.exit(0 if "guest ended with 0 " in said else 1)


main()
