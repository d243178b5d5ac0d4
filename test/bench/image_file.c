/* The image as a file: sizes and function names. */
#include "bench.h"

#include <fcntl.h>
#include <gelf.h>
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define RAM_OFFSET 0x800000u /* where avr-gcc puts RAM in an ELF file */

static Elf *open_elf(const char *path, int *file)
{
    *file = open(path, O_RDONLY);
    if (*file < 0 || elf_version(EV_CURRENT) == EV_NONE)
        die("cannot open %s", path);
    Elf *elf = elf_begin(*file, ELF_C_READ, NULL);
    if (!elf)
        die("%s is no ELF file", path);
    return elf;
}

image_size_t image_size(const char *path)
{
    image_size_t size = {0, 0};
    int file;
    Elf *elf = open_elf(path, &file);
    Elf_Scn *section = NULL;
    while ((section = elf_nextscn(elf, section)) != NULL) {
        GElf_Shdr header;
        if (!gelf_getshdr(section, &header) || !(header.sh_flags & SHF_ALLOC))
            continue;
        bool in_ram = header.sh_addr >= RAM_OFFSET && header.sh_addr < RAM_OFFSET + 0x10000u;
        bool in_file = header.sh_type != SHT_NOBITS && (in_ram || header.sh_addr < RAM_OFFSET);
        if (in_ram)
            size.ram += (uint32_t)header.sh_size;
        if (in_file)
            size.flash += (uint32_t)header.sh_size;
    }
    elf_end(elf);
    close(file);
    return size;
}

void image_where(const char *path, uint16_t address, char *text, size_t size)
{
    uint64_t best = 0;
    int file;
    Elf *elf = open_elf(path, &file);
    Elf_Scn *section = NULL;
    snprintf(text, size, "0x%04x", address);
    while ((section = elf_nextscn(elf, section)) != NULL) {
        GElf_Shdr header;
        if (!gelf_getshdr(section, &header) || header.sh_type != SHT_SYMTAB)
            continue;
        Elf_Data *data = elf_getdata(section, NULL);
        GElf_Sym symbol;
        for (int i = 0; gelf_getsym(data, i, &symbol) != NULL; i++) {
            unsigned char type = GELF_ST_TYPE(symbol.st_info);
            if ((type != STT_FUNC && type != STT_NOTYPE) || symbol.st_value > address || symbol.st_value < best ||
                symbol.st_shndx == SHN_ABS || symbol.st_shndx == SHN_UNDEF)
                continue;
            const char *name = elf_strptr(elf, header.sh_link, symbol.st_name);
            if (!name || !*name || strncmp(name, "__", 2) == 0)
                continue;
            best = symbol.st_value;
            snprintf(text, size, "%s + %u", name, (unsigned)(address - symbol.st_value));
        }
    }
    elf_end(elf);
    close(file);
}
