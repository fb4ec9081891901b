#include "semihosting.h"

#include "bytes.h"

enum { SYS_OPEN = 0x01, SYS_READ = 0x06, SYS_SEEK = 0x0A, SYS_FLEN = 0x0C };
enum { MODE_READ_BINARY = 1, LONGEST_ROW = 2 * 64 };

#if defined(__riscv)
/* The three instructions are the call; they must be uncompressed and lie in one page. */
__asm(".pushsection .text.semihosting_call, \"ax\", @progbits\n"
      ".option push\n"
      ".balign 16\n"
      ".option norvc\n"
      ".type semihosting_call, @function\n"
      "semihosting_call:\n"
      "slli zero, zero, 0x1f\n"
      "ebreak\n"
      "srai zero, zero, 7\n"
      "ret\n"
      ".option pop\n"
      ".popsection");
int32_t semihosting_call(uint32_t operation, const uint32_t parameters[]);

static int32_t call(uint32_t operation, const uint32_t parameters[])
{
    return semihosting_call(operation, parameters);
}
#else
static int32_t call(uint32_t operation, const uint32_t parameters[])
{
    register uintptr_t r0 __asm("r0") = operation;
    register uintptr_t r1 __asm("r1") = (uintptr_t)parameters;
    __asm volatile("bkpt 0xAB" : "+r"(r0) : "r"(r1) : "memory");
    return (int32_t)r0;
}
#endif

bool semihosting_convert(uint32_t conversion, uint8_t count, int16_t codes[])
{
    static int32_t file; /* its handle plus one; 0: not tried yet, -1: not there */
    static const char path[] = "adc.bin";
    uint8_t row[LONGEST_ROW];
    if (file == 0) {
        const uint32_t open[] = {(uint32_t)(uintptr_t)path, MODE_READ_BINARY, sizeof path - 1U};
        const int32_t handle = call(SYS_OPEN, open);
        file = (handle < 0) ? -1 : handle + 1;
    }
    if (file < 0) {
        return false;
    }
    const uint32_t handle = (uint32_t)file - 1U;
    const uint32_t length_of[] = {handle};
    const int32_t length = call(SYS_FLEN, length_of);
    const uint32_t stride = 2U * (uint32_t)count;
    if (length < (int32_t)stride || stride > sizeof row) {
        return false;
    }
    const uint32_t seek[] = {handle, conversion % ((uint32_t)length / stride) * stride};
    const uint32_t read[] = {handle, (uint32_t)(uintptr_t)row, stride};
    if (call(SYS_SEEK, seek) != 0 || call(SYS_READ, read) != 0) {
        return false;
    }
    for (uint8_t i = 0; i < count; i++) {
        codes[i] = signed16(get16(row + (uint32_t)2U * i));
    }
    return true;
}
