#include "image/oiio.h"

#include <OpenImageIO/filesystem.h>
#include <OpenImageIO/imageio.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <mutex>
#include <new>
#include <string>

#include <strings.h>
#include <zlib.h>

extern "C" {
#include "base/files.h"
}

namespace
{

constexpr long long max_pixels = 1LL << 28;

/* OpenImageIO's own pool would add threads that nobody asked for. */
void configure_once()
{
    static std::once_flag once;
    std::call_once(once, [] {
        OIIO::attribute("threads", 1);
        OIIO::attribute("exr_threads", -1);
    });
}

/* One line, whatever the library said. */
std::string one_line(const std::string &text)
{
    std::string line = text.substr(0, text.find('\n'));
    return line.empty() ? std::string("unknown reason") : line;
}

int read_pixels(OIIO::ImageInput &input, const char *name, pt_oiio_image *out, base_err *err)
{
    const OIIO::ImageSpec &spec = input.spec();
    const int channels = std::min(spec.nchannels, 4);
    if (spec.width <= 0 || spec.height <= 0 || channels <= 0 || spec.depth > 1)
        return base_fail(err, BASE_EINVAL, "%s: not a 2-D image (%dx%dx%d, %d channels)", name, spec.width, spec.height,
                         spec.depth, spec.nchannels);
    if (static_cast<long long>(spec.width) * spec.height > max_pixels)
        return base_fail(err, BASE_EINVAL, "%s: %dx%d pixels, more than the 2^28 an image may have", name, spec.width,
                         spec.height);
    const bool bytes = spec.format == OIIO::TypeDesc::UINT8;
    const OIIO::TypeDesc type = bytes ? OIIO::TypeDesc::UINT8 : OIIO::TypeDesc::FLOAT;
    const bool is_float = spec.format.is_floating_point();
    const int width = spec.width, height = spec.height;
    const size_t count = static_cast<size_t>(width) * static_cast<size_t>(height) * static_cast<size_t>(channels);
    void *pixels = std::calloc(count, bytes ? 1 : sizeof(float));
    if (pixels == nullptr)
        return base_fail_nomem(err, name);
    if (!input.read_image(0, 0, 0, channels, type, pixels)) {
        std::free(pixels);
        return base_fail(err, BASE_EINVAL, "%s: %s", name, one_line(input.geterror()).c_str());
    }
    *out = pt_oiio_image{width,
                         height,
                         channels,
                         is_float,
                         bytes ? static_cast<uint8_t *>(pixels) : nullptr,
                         bytes ? nullptr : static_cast<float *>(pixels)};
    return 0;
}

/* Keeps alpha as stored: pbrt never premultiplies. */
OIIO::ImageSpec raw_config()
{
    OIIO::ImageSpec config;
    config.attribute("oiio:UnassociatedAlpha", 1);
    return config;
}

bool is_png(const char *name)
{
    const char *dot = std::strrchr(name, '.');
    return dot != nullptr && strcasecmp(dot, ".png") == 0;
}

/* libpng prints on stderr when a file is damaged (and OpenImageIO then leaks), so damage is found before it sees the data:
 * signature, chunk lengths, checksums, end marker (PNG specification, §5). */
int check_png(const char *name, const unsigned char *data, size_t size, base_err *err)
{
    static const unsigned char signature[8] = {0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
    if (size < sizeof signature || std::memcmp(data, signature, sizeof signature) != 0)
        return base_fail(err, BASE_EINVAL, "%s: not a PNG file", name);
    const auto be32 = [data](size_t at) {
        return static_cast<uint32_t>(data[at]) << 24 | static_cast<uint32_t>(data[at + 1]) << 16 |
               static_cast<uint32_t>(data[at + 2]) << 8 | static_cast<uint32_t>(data[at + 3]);
    };
    for (size_t at = sizeof signature; at < size;) {
        if (size - at < 12 || be32(at) > size - at - 12)
            return base_fail(err, BASE_EINVAL, "%s: truncated PNG file", name);
        const size_t length = be32(at);
        if (crc32(0, data + at + 4, static_cast<uInt>(length + 4)) != be32(at + 8 + length))
            return base_fail(err, BASE_EINVAL, "%s: damaged PNG file (checksum at byte %zu)", name, at);
        if (std::memcmp(data + at + 4, "IEND", 4) == 0)
            return 0;
        at += length + 12;
    }
    return base_fail(err, BASE_EINVAL, "%s: truncated PNG file", name);
}

} // namespace

static int read_memory(const char *name, const void *data, size_t size, struct pt_oiio_image *out, struct base_err *err)
{
    try {
        configure_once();
        if (is_png(name)) {
            const int rc = check_png(name, static_cast<const unsigned char *>(data), size, err);
            if (rc)
                return rc;
        }
        OIIO::Filesystem::IOMemReader reader(data, size);
        const char *dot = std::strrchr(name, '.');
        const std::string extension = dot != nullptr ? dot + 1 : name;
        std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::create(extension, false);
        if (!input || input->supports("ioproxy") == 0) {
            OIIO::geterror();
            return base_fail(err, BASE_EINVAL, "%s: this format cannot be read from memory", name);
        }
        OIIO::ImageSpec config = raw_config(), spec;
        OIIO::Filesystem::IOProxy *proxy = &reader;
        config.attribute("oiio:ioproxy", OIIO::TypeDesc::PTR, &proxy);
        if (!input->open(name, spec, config))
            return base_fail(err, BASE_EINVAL, "%s: not an image that can be read: %s", name,
                             one_line(input->geterror()).c_str());
        return read_pixels(*input, name, out, err);
    } catch (const std::bad_alloc &) {
        return base_fail_nomem(err, name);
    } catch (const std::exception &e) {
        return base_fail(err, BASE_EINVAL, "%s: %s", name, one_line(e.what()).c_str());
    }
}

static int read_file(const char *path, struct pt_oiio_image *out, struct base_err *err)
{
    try {
        configure_once();
        if (int rc = base_file_check_input(path, err))
            return rc;
        if (is_png(path)) {
            char *data = nullptr;
            size_t size = 0;
            int rc = base_file_read(path, 1u << 30, &data, &size, err);
            if (!rc)
                rc = read_memory(path, data, size, out, err);
            std::free(data);
            return rc;
        }
        const OIIO::ImageSpec config = raw_config();
        std::unique_ptr<OIIO::ImageInput> input = OIIO::ImageInput::open(path, &config);
        if (!input)
            return base_fail(err, BASE_EINVAL, "%s: not an image that can be read: %s", path,
                             one_line(OIIO::geterror()).c_str());
        return read_pixels(*input, path, out, err);
    } catch (const std::bad_alloc &) {
        return base_fail_nomem(err, path);
    } catch (const std::exception &e) {
        return base_fail(err, BASE_EINVAL, "%s: %s", path, one_line(e.what()).c_str());
    }
}

extern "C" const struct pt_oiio_library pt_oiio_library = {read_file, read_memory};
